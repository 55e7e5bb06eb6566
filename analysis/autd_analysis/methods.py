"""What was computed and how, in words that go with every result."""

from collections.abc import Mapping

METHODS: Mapping[str, str] = {
    "trials": "Only complete trials with an answer are counted; the remarks say what was not counted.",
    "participant_rate": (
        "A participant's rate is felt / trials, with Wilson's 95 % score interval, which takes the trials as "
        "independent and equally likely to be felt; beside it Clopper and Pearson's exact interval and "
        "Jeffreys', which ends at 0 or 1 where none or all were felt."
    ),
    "rate": (
        "A condition's rate is the mean of the participants' rates, with Student's 95 % t interval over "
        "participants, whose ends are kept within 0..1; no interval for one participant or if all have the "
        "same rate. Beside it the percentile interval of the participant bootstrap over all n^n resamples, "
        "and the beta-binomial model's mean with its profile-likelihood interval and the correlation of two "
        "answers of one person; its test of overdispersion is halved, as a correlation is not negative."
    ),
    "false_alarm_rate": "The share of catch trials answered as felt; undefined without catch trials.",
    "difference": (
        "A planned comparison is the mean over participants of rate at first minus rate at second, with "
        "Student's 95 % t interval; participants without both rates are left out and named. Over factors "
        "that are not compared, cells are averaged, each counting the same."
    ),
    "sign_flip": (
        "Exact two-sided sign-flip test of the mean difference over all 2^n sign patterns; its least p is "
        "2 / 2^k with k differences that are not zero."
    ),
    "paired_t": (
        "Paired t test, two-sided; not testable if all differences are equal. dz is mean / SD, its 95 % "
        "interval by the noncentral t distribution."
    ),
    "detectability": (
        "d' = z(hits) - z(false alarms) with the log-linear correction (counts + 1/2 over trials + 1), hits "
        "of a condition against the catch trials of its kind of block; undefined without catch trials."
    ),
    "wilcoxon": (
        "Exact two-sided Wilcoxon signed-rank test with mid-ranks, zeros left out; beside the planned tests."
    ),
    "bayes_factor": (
        "JZS Bayes factor of the paired t test, Cauchy prior of scale 0.707 on the effect size; over 1 "
        "speaks for a difference."
    ),
    "mixed_model": (
        "Logistic mixed model of the single answers at the level where factors are compared (of all answers, "
        "where it is overall): every condition a fixed effect, a random intercept and a random slope for the "
        "compared factor over participants, by adaptive Gauss-Hermite quadrature (9 nodes or more per "
        "effect); difference in logits with Wald's 95 % interval, likelihood-ratio test. "
        "Where all or none were felt in a condition, half an answer of each kind is added to every condition "
        "(Firth's penalty)."
    ),
    "model_means": (
        "Mixed model of all answers, otherwise like that of a comparison, with logit and with probit link. "
        "Means are those of the average participant, whose random effects are zero, and those of the "
        "population, averaged over the normal distribution of random effects; intervals are Wald's on the "
        "scale of the link (delta method). Simple effects: Wald's z test, Holm's adjustment over those of a "
        "model; interaction: likelihood-ratio test that they are all the same, not adjusted. Both take a "
        "participant's slope for the same at all levels of the other factor and find too much where it is "
        "not: they describe, and decide nothing."
    ),
    "other_models": (
        "GEE (population-averaged logits, exchangeable correlation) with the uncorrected sandwich, Kauermann "
        "and Carroll's and Mancl and DeRouen's covariance, t with Satterthwaite's degrees of freedom "
        "(McCaffrey and Bell): of the three, Kauermann and Carroll's is the one to use. Conditional logistic "
        "regression and Firth's, with a level for each participant, take the difference for the same in all "
        "people: their errors are too small where it is not. Firth's interval and test are by the penalised "
        "profile likelihood. Not adjusted."
    ),
    "interaction": (
        "Interaction of a planned comparison with the other factor: Hotelling's T squared of participants' "
        "differences, and exact sign flips of each participant's contrasts (squared length of their sum); "
        "trend: least-squares slope of each participant's differences over octaves of the other factor, "
        "paired t and exact sign-flip test. Not planned, not adjusted."
    ),
    "order_effects": (
        "Checks of order: slopes of answers over the course of a session and of a block and from session to "
        "session, and the correlation with the answer before, tested by 1999 shuffles of answers within "
        "participant and condition (seed 1); order of blocks and carry-over by Welch's t test between those "
        "who began with either."
    ),
    "threshold": (
        "With an adaptive method: a participant's threshold in a condition is the geometric mean of an even "
        "number of a staircase's reversals with its final steps, for the rate at which the staircase "
        "settles, or the mean of QUEST+'s posterior in dB, for the level at which the stimulus alone, "
        "guesses and lapses aside, is felt half the time. Means, intervals, paired t and exact sign-flip "
        "tests are of thresholds in dB over participants; those whose tracks do not tell a threshold are "
        "left out and counted. The exact sign test counts them too where a threshold seems to lie beyond "
        "the levels, and so beyond the other."
    ),
    "timing": (
        "Onset lateness is the actual minus the planned onset, and an onset is late over 1 ms; of complete "
        "stimulus trials in real time, as nothing can be late in virtual time."
    ),
    "response_time": (
        "From the onset to the first press, of stimuli that were felt; a participant's median and quartiles "
        "(interpolated linearly), and the mean of the participants' medians with Student's 95 % t interval."
    ),
    "psychometric": (
        "Psychometric function of each participant along a factor of three or more numbers, p = guess + (1 - "
        "guess - lapse) F with F normal along octaves (units, where a level is negative), fitted by maximum "
        "likelihood and never falling, the likeliest of climbs from several starts; threshold where F is 0.5, "
        "so that p is halfway from guess to 1 - lapse, slope dF/dt there. Unless asked for otherwise: lapse "
        "rate 0.02; one guess rate for all conditions of a participant, estimated from catch trials and "
        "stimuli, or 0 without catch trials. Estimated guess rates are at most .4 and lapse rates .5, and both "
        "leave .1. 95 % profile-likelihood intervals, and percentile intervals of 400 parametric bootstrap "
        "resamples (seed 1), which also give the p of the deviance. A level of 0 counts as no stimulus."
    ),
    "psychometric_group": (
        "Over participants: the (along octaves geometric) mean of thresholds with Student's 95 % t interval, "
        "and a mixed model of all answers with random intercept and steepness by adaptive Gauss-Hermite "
        "quadrature, each participant's guess and lapse rates taken as known; its threshold is that of an "
        "average participant, with Fieller's 95 % interval by Student's t with participants - 1 degrees of "
        "freedom."
    ),
    "holm": (
        "Holm's adjustment over all planned comparisons together, for each of the three tests by itself; "
        "comparisons that could not be tested do not count."
    ),
}
"""A sentence or two for each quantity of the results."""
