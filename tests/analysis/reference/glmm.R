# Makes glmm.csv, with which tests/analysis/models/test_glmm.py compares: Rscript glmm.R (Debian: r-cran-lme4, r-cran-emmeans).
# Studies are in glmm_studies.csv, which were drawn at random; cells are fixed effects, clothing is +-1/2.
suppressMessages({library(lme4); library(emmeans)})
studies <- read.csv("glmm_studies.csv")
studies$cell <- factor(paste(studies$modulation_hz, studies$clothing))
studies$slope <- ifelse(studies$clothing == "both", 0.5, -0.5)
studies$participant <- factor(studies$participant)
tight <- glmerControl(optimizer = "bobyqa", optCtrl = list(maxfun = 1e5, rhoend = 1e-9), tolPwrss = 1e-12)
rows <- list()
add <- function(study, model, name, value) rows[[length(rows) + 1]] <<- data.frame(study, model, name, value)
for (k in unique(studies$study)) {
  d <- droplevels(studies[studies$study == k, ])
  fits <- list(
    slope_laplace = suppressWarnings(suppressMessages(glmer(cbind(felt, trials - felt) ~ 0 + cell + (1 + slope | participant), d, binomial, control = tight))),
    intercept_25 = suppressWarnings(suppressMessages(glmer(cbind(felt, trials - felt) ~ 0 + cell + (1 | participant), d, binomial, control = tight, nAGQ = 25)))
  )
  for (model in names(fits)) {
    fit <- fits[[model]]
    beta <- fixef(fit)
    for (name in names(beta)) add(k, model, sub("cell", "", name), beta[[name]])
    errors <- sqrt(diag(as.matrix(vcov(fit))))
    for (i in seq_along(beta)) add(k, model, paste("se", sub("cell", "", names(beta)[i])), errors[[i]])
    spread <- attr(VarCorr(fit)$participant, "stddev")
    for (i in seq_along(spread)) add(k, model, paste("sd", i), spread[[i]])
  }
  d$at100 <- ifelse(d$modulation_hz == 100, "100", as.character(d$cell))
  reduced <- suppressWarnings(suppressMessages(glmer(cbind(felt, trials - felt) ~ 0 + at100 + (1 + slope | participant), d, binomial, control = tight)))
  add(k, "slope_laplace", "lr 100", max(0, 2 * as.numeric(logLik(fits$slope_laplace) - logLik(reduced))))
}
add(0, "version", paste("R", getRversion()), 0)
add(0, "version", paste("lme4", packageVersion("lme4")), 0)
write.csv(do.call(rbind, rows), "glmm.csv", row.names = FALSE)
