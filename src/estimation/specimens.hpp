#pragma once

#include "estimation/fit.hpp"
#include "estimation/press_objective.hpp"

namespace pliant {

/// Quadratic tetrahedra, which do not lock where the material hardly changes its volume, unless others are chosen; they
/// follow as much as half as many linear ones again along each axis, so they are so much longer. A volume that the
/// capture gives keeps its nodes.
Resolution resolution_of_tests(const Capture& capture, const FitOptions& options);

/// The objects of captures on their meshes, with their static tests; of several, names of tests begin with the folder
/// of their capture. A capture without a scan has stress-strain curves alone.
/// @param finer      times as many elements along each axis as the choices say
/// @param are_named  names of tests begin so for one capture too
/// Throws InputError where there is neither, or a test cannot be read.
std::vector<TestedSpecimen> specimens_of(const std::vector<const Capture*>& captures, const FitOptions& options,
                                         double finer = 1.0, bool are_named = false);

}  // namespace pliant
