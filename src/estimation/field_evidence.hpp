#pragma once

#include <vector>

#include "estimation/objective.hpp"
#include "estimation/uncertainty.hpp"

namespace pliant {

/// Prior of a field of moduli: ln E varies over the object like Levy's Brownian motion, so that ln of the ratio of two
/// points' moduli has a variance in proportion to their distance, whatever other control points there are. A common
/// factor of all is free.
/// @param points     control points, none twice [m]
/// @param length     of the object [m], > 0
/// @param deviation  of ln E between points as far apart as that, > 0
/// @return           precision of ln E at the points, singular for a common factor
MatrixX field_precision(const std::vector<Vector3>& points, double length, double deviation);

/// Logarithm of the Bayes factor of a field of moduli against another one that it can take the form of: of the evidence
/// of the estimate d of what the finer field has beyond the coarser (contrasts of its ln E that vanish where it has the
/// coarser one's form). Under the coarser field d is N(0, V), under the finer one N(0, V + P) with P of
/// `field_precision`. d is where a Gauss-Newton step leads from p, everything else following along: at the finer
/// field's estimate the estimate itself, before that what it promises (Rao's score test, 1948). V is the covariance
/// that curvature and residuals claim and that of the scatter of the frames' gradients (a sandwich,
/// `gradient_scatter`), added: neighbouring frames err together where the model is a little wrong, and such errors
/// shall not buy freedom.
/// @param evaluation  of the finer field, with derivatives, at p
/// @param parameters  with its moduli and their `field_precision` as joint prior
/// @param carried     ln E of the finer field by that of the coarser, finer x coarser (`carried_over`)
double log_bayes_factor(const CostEvaluation& evaluation, const ParameterSet& parameters, const VectorX& p,
                        const MatrixX& carried);

/// The same about any contrasts of p: the coarser hypothesis is that they vanish, under the finer one they are
/// N(0, P). The parameters' joint prior counts as part of the hypotheses, their own priors do not.
/// @param contrasts  rows x dimension of p
/// @param prior      P, rows x rows
double log_bayes_factor(const CostEvaluation& evaluation, const ParameterSet& parameters, const VectorX& p,
                        const MatrixX& contrasts, const MatrixX& prior);

/// The same of an estimate whose whole uncertainty is known: V is its covariance by noise, by other models and by what
/// parts of a motion differ by, as wide as its 90 % intervals are beside those of a normal distribution.
double log_bayes_factor(const Uncertainty& uncertainty, const ParameterSet& parameters, const VectorX& p,
                        const MatrixX& carried);

/// Covariance of the sum of the frames' gradients about their mean, by how they scatter; neighbouring frames may be
/// correlated (Newey and West 1987).
/// @param mean  of a frame's gradient; empty: zero, as at an estimate
MatrixX gradient_scatter(const CostEvaluation& evaluation, const VectorX& mean = {});

}  // namespace pliant
