# Makes psychometric.csv, with which tests/analysis/psychometric compares: Rscript psychometric.R > psychometric.csv
# Made with R 4.2.2 and MASS 7.3-58.2 (Debian r-base-core, r-cran-mass). Without guesses and lapses a psychometric
# function is a binomial GLM in t = log2(x): logit, probit, cloglog. Threshold: t at which p is 0.5.
suppressMessages(library(MASS))
data <- list(
  three = data.frame(x = c(25, 50, 100), felt = c(3, 6, 9), n = 10),
  six = data.frame(x = c(0.1, 0.15, 0.25, 0.4, 0.6, 1), felt = c(1, 3, 6, 14, 18, 20), n = c(20, 19, 20, 21, 20, 20)),
  single = data.frame(x = c(8, 9.5, 11, 12, 13, 15, 16, 18, 21, 22, 25, 30), felt = c(0, 0, 1, 0, 0, 1, 1, 0, 1, 1, 1, 1), n = 1))
links <- c(logistic = "logit", normal = "probit", Weibull = "cloglog")
rate <- qchisq(0.95, 1)
cat("data,core,x,felt,n,threshold,threshold_se,steepness,log_likelihood,deviance,low,high,steepness_low,steepness_high\n")
for (name in names(data)) for (core in names(links)) {
  d <- data[[name]]; d$t <- log2(d$x)
  family <- binomial(links[[core]])
  control <- glm.control(epsilon = 1e-14, maxit = 100)
  fit <- glm(cbind(felt, n - felt) ~ t, family, d, control = control)
  dose <- dose.p(fit, p = 0.5)
  likelihood <- function(predictor) {
    p <- pmin(pmax(family$linkinv(predictor), 1e-300), 1 - 1e-16)
    sum(d$felt * log(p) + (d$n - d$felt) * log(1 - p))
  }
  b <- coef(fit)[[2]]
  top <- likelihood(coef(fit)[[1]] + b * d$t)
  best <- function(of) optimize(of, c(-12, 8), maximum = TRUE, tol = 1e-12)$objective
  # profile of the threshold: the best steepness of a predictor that is linkfun(0.5) at m
  drop <- function(m) 2 * (top - best(function(x) likelihood(family$linkfun(0.5) + exp(x) * (d$t - m)))) - rate
  reach <- diff(range(d$t))
  low <- uniroot(drop, c(dose - 0.8 * reach, dose), tol = 1e-10)$root
  high <- uniroot(drop, c(dose, dose + 0.8 * reach), tol = 1e-10)$root
  slope <- function(b) 2 * (top - best(function(x) likelihood(b * (d$t - dose) + x))) - rate
  steep_low <- uniroot(slope, c(0.02 * b, b), tol = 1e-10)$root
  steep_high <- uniroot(slope, c(b, 4 * b), tol = 1e-10)$root
  log_likelihood <- sum(d$felt * log(fitted(fit)) + (d$n - d$felt) * log(1 - fitted(fit)))
  for (i in seq_len(nrow(d)))
    writeLines(paste(c(name, core, d$x[i], d$felt[i], d$n[i], sprintf("%.10g", c(dose, attr(dose, "SE"), b,
      log_likelihood, fit$deviance, low, high, steep_low, steep_high))), collapse = ","))
}
