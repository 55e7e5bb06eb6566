"""Other choices of tests and models in words."""

from collections.abc import Mapping

DEFINITIONS: Mapping[str, str] = {
    "other_models": (
        "GEE (population-averaged logits, exchangeable correlation) with the uncorrected sandwich, Kauermann "
        "and Carroll's and Mancl and DeRouen's covariance, t with Satterthwaite's degrees of freedom "
        "(McCaffrey and Bell): of the three, Kauermann and Carroll's is the one to use. Conditional logistic "
        "regression and Firth's, with a level for each participant, take the difference for the same in all "
        "people: their errors are too small where it is not. Firth's interval and test are by the penalised "
        "profile likelihood. Not adjusted."
    ),
    "pooled": (
        "Chi-squared, Fisher's, Cochran, Mantel and Haenszel's and McNemar's tests of all participants' "
        "answers together take people for alike in how much the condition matters to them; where they are "
        "not, these p are too small. Not adjusted."
    ),
    "adjusted_p": (
        "The planned p, adjusted for their number by Bonferroni, Holm, Hochberg, and Benjamini and Hochberg; "
        "Holm's is the planned one."
    ),
}
"""How each quantity was found."""
