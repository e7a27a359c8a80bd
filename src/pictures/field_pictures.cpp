#include "pictures/field_pictures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "report/plot.hpp"

namespace pliant {

namespace {

constexpr int states_drawn = 4;    // of states that are spread evenly
constexpr double changed = 0.2;    // of a modulus by strain, from where on it is worth pictures
constexpr double uneven = 0.01;    // of a modulus at rest over the object, likewise
constexpr double percent = 100.0;  // strains are told in per cent

/// The greatest number that is one; 0 without any.
double most_of(const std::vector<double>& values) {
  double most = 0.0;
  for (const double v : values)
    if (std::isfinite(v)) most = std::max(most, v);
  return most;
}

double mean_of(const Body& body, const std::vector<double>& of_elements) {
  double sum = 0.0, volume = 0.0;
  for (std::size_t e = 0; e < of_elements.size(); ++e) {
    if (!std::isfinite(of_elements[e])) continue;
    sum += body.element_volume[e] * of_elements[e], volume += body.element_volume[e];
  }
  return volume > 0.0 ? sum / volume : 0.0;
}

std::vector<double> times(double factor, std::vector<double> values) {
  for (double& v : values) v *= factor;
  return values;
}

}  // namespace

FieldStates frames_at(const std::vector<double>& times, int first) {
  FieldStates states{"time [s]"};
  for (std::size_t i = 0; i < times.size(); ++i) {
    states.at.push_back(times[i] - times.front());
    states.names.push_back(fmt::format("Frame {}, {} s", first + int(i), readable(states.at.back(), 3)));
  }
  return states;
}

FieldPictures::FieldPictures(std::shared_ptr<const Body> body, Elasticity& elasticity, const TriangleMesh& surface,
                             std::vector<double> modulus_std, FieldStates states)
    : body_(std::move(body)),
      vertices_(*body_, surface.vertices),
      modulus_(body_fields(*body_, elasticity, body_->reference_positions()).tangent_modulus),
      modulus_std_(std::move(modulus_std)),
      states_(std::move(states)),
      chosen_(spread_frames(0, int(states_.at.size()) - 1, states_drawn)) {}

FieldPictures::Drawn FieldPictures::drawn(int state, double most, const Points& nodes, const BodyFields& f) const {
  return {
      state,
      most,
      vertices_.positions(nodes),
      {averages_at(*body_, vertices_, f.von_mises), times(percent, averages_at(*body_, vertices_, f.greatest_strain)),
       averages_at(*body_, vertices_, f.tangent_modulus)}};
}

void FieldPictures::add(int state, const Points& nodes, const BodyFields& fields) {
  const double most = most_of(fields.von_mises);
  const std::array<const std::vector<double>*, count> values = {&fields.von_mises, &fields.greatest_strain,
                                                                &fields.tangent_modulus};
  for (std::size_t k = 0; k < count; ++k) {
    const double factor = k == Strain ? percent : 1.0;
    courses_[k].at.push_back(states_.at[std::size_t(state)]);
    courses_[k].greatest.push_back(factor * most_of(*values[k]));
    courses_[k].mean.push_back(factor * mean_of(*body_, *values[k]));
  }
  for (std::size_t e = 0; e < modulus_.size(); ++e)
    modulus_changes_ = modulus_changes_ || std::abs(fields.tangent_modulus[e] / modulus_[e] - 1.0) > changed;
  if (std::ranges::binary_search(chosen_, state))
    drawn_.push_back(drawn(state, most, nodes, fields));
  else if (!hardest_ || most > hardest_->most)
    hardest_ = drawn(state, most, nodes, fields);
}

ReportField FieldPictures::at_rest(const Gallery& gallery, const std::vector<double>& of_elements,
                                   const std::string& name, const std::string& caption) const {
  const FieldState state{vertices_.positions(body_->reference_positions()), averages_at(*body_, vertices_, of_elements),
                         caption};
  return draw_field(gallery, {state}, name, "Pa", ScaleEnds::All);
}

std::vector<ReportField> FieldPictures::draw(const Gallery& gallery) const {
  std::vector<ReportField> fields;
  std::vector<const Drawn*> shown;
  for (const Drawn& d : drawn_) shown.push_back(&d);
  if (hardest_ && std::ranges::all_of(drawn_, [&](const Drawn& d) { return d.most < hardest_->most; }))
    shown.push_back(&*hardest_);
  std::ranges::sort(shown, {}, &Drawn::state);
  struct Told {
    const char *name, *unit;
    ScaleEnds ends;
  };
  constexpr std::array<Told, count> told = {{{"von Mises stress", "Pa", ScaleEnds::FromZero},
                                             {"greatest principal strain", "%", ScaleEnds::FromZero},
                                             {"Young's modulus under strain", "Pa", ScaleEnds::All}}};
  for (std::size_t k = 0; k < count && !shown.empty(); ++k) {
    if (k == Modulus && !modulus_changes_) continue;
    std::vector<FieldState> states;
    for (const Drawn* d : shown)
      states.push_back({d->surface, d->values[k],
                        states_.names[std::size_t(d->state)] + (d == &*hardest_ ? ": the greatest stress" : "")});
    ReportField field = draw_field(gallery, states, told[k].name, told[k].unit, told[k].ends);
    field.abscissa = states_.abscissa;
    field.at = courses_[k].at, field.greatest = courses_[k].greatest, field.mean = courses_[k].mean;
    fields.push_back(std::move(field));
  }
  const auto [least, most] = std::ranges::minmax(modulus_);
  if (most - least <= uneven * least) return fields;
  fields.push_back(at_rest(gallery, modulus_, "Young's modulus at rest", "Over the object as it is free of stress"));
  if (!modulus_std_.empty())
    fields.push_back(at_rest(gallery, modulus_std_, "standard deviation of Young's modulus",
                             "How sure the modulus is: the modulus times the deviation of its logarithm"));
  return fields;
}

}  // namespace pliant
