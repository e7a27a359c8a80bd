#pragma once

#include <memory>

#include "elasticity/body.hpp"
#include "elasticity/material_law.hpp"
#include "model/model.hpp"

namespace pliant {

/// A law as the table that a model keeps, and back.
/// Throws InputError for a law of another name, other columns, or another number of elements.
ModelLaw model_law(const MaterialLaw& law);
std::shared_ptr<const MaterialLaw> make_law(const ModelLaw& table, int elements);

/// The law of a model, made of its own moduli where it names none: that by which it moves.
/// @param body  see `model_body`
std::shared_ptr<const MaterialLaw> law_of(const Model& model, const Body& body);

}  // namespace pliant
