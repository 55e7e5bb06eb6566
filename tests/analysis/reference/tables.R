# Reference values of tests of tables, by R's own functions. Run: Rscript tables.R > tables.csv
# Made with R 4.2.2 (Debian r-base-core); every line is a stratum: felt and trials at two levels.
strata <- list(
  chest = rbind(c(10, 10, 3, 10), c(10, 10, 4, 10), c(10, 10, 7, 10), c(9, 10, 2, 10),
                c(10, 10, 9, 10), c(9, 10, 1, 10), c(10, 10, 5, 10), c(9, 10, 6, 10)),
  small = rbind(c(1, 3, 0, 3), c(2, 3, 2, 3), c(3, 3, 1, 2), c(0, 4, 0, 4)),
  equal = rbind(c(5, 10, 5, 10), c(2, 10, 3, 10), c(8, 10, 7, 10)))
cat("study,first_felt,first_n,second_felt,second_n,cmh_p,exact_p,odds_ratio,low,high\n")
for (name in names(strata)) {
  s <- strata[[name]]
  x <- array(apply(s, 1, function(r) c(r[1], r[3], r[2] - r[1], r[4] - r[3])), c(2, 2, nrow(s)))
  plain <- mantelhaen.test(x, correct = FALSE)
  exact <- mantelhaen.test(x, exact = TRUE)
  for (i in seq_len(nrow(s)))
    cat(name, s[i, ], sprintf("%.10g", c(plain$p.value, exact$p.value, plain$estimate, plain$conf.int)),
        sep = ",", fill = FALSE, "\n")
}
