# Makes models.csv, with which tests/analysis/models/ compares: Rscript models.R (Debian: r-cran-lme4, r-cran-emmeans,
# r-cran-geepack, r-cran-survival, r-cran-brglm2). Studies are those of glmm_studies.csv.
suppressMessages({library(lme4); library(emmeans); library(geepack); library(survival); library(brglm2)})
studies <- read.csv("glmm_studies.csv")
studies$hertz <- factor(studies$modulation_hz)
studies$clothing <- factor(studies$clothing, levels = c("inner", "both"))
studies$cell <- factor(paste(studies$modulation_hz, studies$clothing))
studies$slope <- ifelse(studies$clothing == "both", 0.5, -0.5)
studies$participant <- factor(studies$participant)
tight <- glmerControl(optimizer = "bobyqa", optCtrl = list(maxfun = 1e5, rhoend = 1e-9), tolPwrss = 1e-12)
glmer_quietly <- function(...) suppressWarnings(suppressMessages(glmer(..., control = tight)))
rows <- list()
add <- function(study, model, name, value) rows[[length(rows) + 1]] <<- data.frame(study, model, name, value)
single_answers <- function(d) {
  n <- d$trials
  data.frame(d[rep(seq_len(nrow(d)), n), c("participant", "cell", "clothing")],
             felt = unlist(Map(function(y, k) rep(c(1, 0), c(y, k - y)), d$felt, n)))
}
add_means <- function(k, d, link) {
  family <- binomial(link)
  fit <- glmer_quietly(cbind(felt, trials - felt) ~ hertz * clothing + (1 + slope | participant), d, family)
  means <- as.data.frame(emmeans(fit, ~ hertz * clothing))
  probabilities <- as.data.frame(emmeans(fit, ~ hertz * clothing, type = "response"))
  simple <- as.data.frame(rbind(pairs(emmeans(fit, ~ clothing | hertz)), adjust = "holm"))
  model <- paste0("emmeans_", link)
  for (i in seq_len(nrow(means))) {
    cell <- paste(means$hertz[i], means$clothing[i])
    add(k, model, paste("mean", cell), means$emmean[i])
    add(k, model, paste("se", cell), means$SE[i])
    add(k, model, paste("probability", cell), probabilities$prob[i])
    add(k, model, paste("low", cell), probabilities$asymp.LCL[i])
    add(k, model, paste("high", cell), probabilities$asymp.UCL[i])
  }
  for (i in seq_len(nrow(simple))) {
    add(k, model, paste("effect", simple$hertz[i]), simple$estimate[i])
    add(k, model, paste("effect se", simple$hertz[i]), simple$SE[i])
    add(k, model, paste("effect z", simple$hertz[i]), simple$z.ratio[i])
    add(k, model, paste("effect holm", simple$hertz[i]), simple$p.value[i])
  }
  additive <- glmer_quietly(cbind(felt, trials - felt) ~ hertz + clothing + (1 + slope | participant), d, family)
  add(k, model, "interaction lr", 2 * as.numeric(logLik(fit) - logLik(additive)))
}
add_gee <- function(k, d, model) {
  fit <- geeglm(felt ~ 0 + cell, binomial, single_answers(d), id = participant, corstr = "exchangeable",
                control = geese.control(epsilon = 1e-10, maxit = 100))
  found <- summary(fit)$coefficients
  for (name in rownames(found)) {
    add(k, model, sub("cell", "", name), found[name, "Estimate"])
    add(k, model, paste("se", sub("cell", "", name)), found[name, "Std.err"])
  }
}
add_conditional <- function(k, d, model) {
  fit <- clogit(felt ~ cell + strata(participant), single_answers(d), method = "exact",
                control = coxph.control(eps = 1e-12, toler.chol = 1e-13, iter.max = 100))
  for (name in names(coef(fit))) add(k, model, sub("cell", "", name), coef(fit)[[name]])
  errors <- sqrt(diag(vcov(fit)))
  for (i in seq_along(errors)) add(k, model, paste("se", sub("cell", "", names(coef(fit))[i])), errors[[i]])
  add(k, model, "lr", 2 * diff(fit$loglik))
}
add_firth <- function(k, d, model, formula) {
  fit <- glm(formula, binomial, d, method = "brglmFit", type = "AS_mean", epsilon = 1e-12, maxit = 1000)
  kept <- grep("cell", names(coef(fit)), value = TRUE)
  errors <- sqrt(diag(vcov(fit)))
  for (name in kept) {
    add(k, model, sub("cell", "", name), coef(fit)[[name]])
    add(k, model, paste("se", sub("cell", "", name)), errors[[name]])
  }
}
add_probit <- function(k, d) {
  fit <- glmer_quietly(cbind(felt, trials - felt) ~ 0 + cell + (1 | participant), d, binomial("probit"), nAGQ = 25)
  for (name in names(fixef(fit))) add(k, "probit_25", sub("cell", "", name), fixef(fit)[[name]])
  add(k, "probit_25", "sd 1", attr(VarCorr(fit)$participant, "stddev")[[1]])
}
for (k in unique(studies$study)) {
  d <- droplevels(studies[studies$study == k, ])
  at100 <- droplevels(d[d$modulation_hz == 100, ])
  for (link in c("logit", "probit")) add_means(k, d, link)
  add_probit(k, d)
  add_gee(k, d, "gee")
  uneven <- transform(d, trials = pmax(felt, 3 + 7 * (seq_len(nrow(d)) %% 2)))
  add_gee(k, uneven, "gee_uneven")
  add_conditional(k, at100, "clogit_100")
  add_conditional(k, d, "clogit")
  separated <- at100
  everyone <- separated$clothing == "inner"
  separated$felt[everyone] <- separated$trials[everyone]
  add_firth(k, d, "firth_cells", cbind(felt, trials - felt) ~ 0 + cell)
  add_firth(k, separated, "firth_separated", cbind(felt, trials - felt) ~ participant + cell)
}
for (package in c("lme4", "emmeans", "geepack", "survival", "brglm2"))
  add(0, "version", paste(package, packageVersion(package)), 0)
add(0, "version", paste("R", getRversion()), 0)
written <- do.call(rbind, rows)
written$value <- signif(written$value, 10)
write.csv(written, "models.csv", row.names = FALSE)
