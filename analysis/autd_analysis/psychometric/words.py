"""Psychometric functions in words."""

from collections.abc import Mapping

DEFINITIONS: Mapping[str, str] = {
    "psychometric": (
        "Psychometric function of each participant along a factor of three or more numbers, p = guess + (1 "
        "- guess - lapse) F with F normal along octaves (units, where a level is negative), fitted by "
        "maximum likelihood and never falling, the likeliest of climbs from several starts; threshold where"
        " F is 0.5, so that p is halfway from guess to 1 - lapse, slope dF/dt there. Unless asked for "
        "otherwise: lapse rate 0.02; one guess rate for all conditions of a participant, estimated from "
        "catch trials and stimuli, or 0 without catch trials. Estimated guess rates are at most .4 and "
        "lapse rates .5, and both leave .1. 95% profile-likelihood intervals, and percentile intervals of "
        "400 parametric bootstrap resamples (seed 1), which also give the p of the deviance. A level of 0 "
        "counts as no stimulus."
    ),
    "psychometric_group": (
        "Over participants: the (along octaves geometric) mean of thresholds with Student's 95% t interval, "
        "and a mixed model of all answers with random intercept and steepness by adaptive Gauss-Hermite "
        "quadrature, each participant's guess and lapse rates taken as known; its threshold is that of an "
        "average participant, with Fieller's 95% interval by Student's t with participants - 1 degrees of "
        "freedom."
    ),
}
"""How each quantity was found."""
