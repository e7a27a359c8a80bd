#pragma once

#include "estimation/fit.hpp"

namespace pliant {

/// A fit with as many control points of Young's modulus as the recordings support. The homogeneous object is fitted
/// first; then fields of 2, 3, 4, 6, 8, ... points, each from the best one so far and only where one step of Gauss and
/// Newton promises enough. A field of more points is kept where there is strong evidence of what it has beyond the best
/// one before (`log_bayes_factor` above `strong_evidence`); two numbers in a row without it end the search. Where the
/// capture names regions they are the field, and there is nothing to choose.
/// @param resume  see `fit`; the state of an interrupted choice goes on with the field that was under way
FitOutcome fit_with_chosen_field(const std::vector<RecordedCapture>& recordings, const FitOptions& options,
                                 const FitMonitor& monitor, FitState resume);

/// ln of the Bayes factor B above which evidence is called strong: 2 ln B > 6 (Kass and Raftery 1995).
inline constexpr double strong_evidence = 3.0;

/// The moduli of one field that come closest to another field of the same body, by ln E of its elements and their
/// volumes: ln E_to = M ln E_from.
/// @return  M, controls of `to` x controls of `from`
MatrixX carried_over(const Body& body, const ModulusField& from, const ModulusField& to);

}  // namespace pliant
