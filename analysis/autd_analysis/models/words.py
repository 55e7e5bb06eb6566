"""Mixed models of all answers in words."""

from collections.abc import Mapping

DEFINITIONS: Mapping[str, str] = {
    "model_means": (
        "Mixed model of all answers, otherwise like that of a comparison, with logit and with probit link. "
        "Means are those of the average participant, whose random effects are zero, and those of the "
        "population, averaged over the normal distribution of random effects; intervals are Wald's on the "
        "scale of the link (delta method). Simple effects: Wald's z test, Holm's adjustment over those of a "
        "model; interaction: likelihood-ratio test that they are all the same, not adjusted. Both take a "
        "participant's slope for the same at all levels of the other factor and find too much where it is "
        "not: they describe, and decide nothing."
    ),
}
"""How each quantity was found."""
