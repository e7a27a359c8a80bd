#include "estimation/cost_bytes.hpp"

namespace pliant {

namespace {

/// Calls each(member) for all members of a frame's fit but its rows, of which it is one type or another that is const
/// or not.
template <class Frame, class Each>
void for_members_of_frame(Frame& f, const Each& each) {
  each(f.recording), each(f.frame), each(f.points), each(f.matched), each(f.outlines), each(f.tracks);
  each(f.independent), each(f.cost), each(f.gradient), each(f.gauss_newton), each(f.distances);
  each(f.sum_squares), each(f.max_distance), each(f.sum_noise_squares), each(f.outline_sum_squares),
      each(f.track_sum_squares);
}

template <class Rows, class Each>
void for_members_of_rows(Rows& rows, const Each& each) {
  each(rows.residual), each(rows.weight), each(rows.J);
}

/// All members of an evaluation but its frames.
template <class Evaluation, class Each>
void for_members_of_evaluation(Evaluation& e, const Each& each) {
  each(e.succeeded), each(e.failure), each(e.cost), each(e.gradient), each(e.gauss_newton), each(e.steps), each(e.work);
}

}  // namespace

void write(const CostEvaluation& evaluation, ByteWriter& to) {
  const auto add = [&](const auto& member) { to.add(member); };
  for_members_of_evaluation(evaluation, add);
  to.add(evaluation.frames.size());
  for (const FrameFit& frame : evaluation.frames) {
    for_members_of_frame(frame, add);
    to.add(frame.rows.size());
    for (const ResidualRows& rows : frame.rows) for_members_of_rows(rows, add);
  }
}

CostEvaluation read_evaluation(ByteReader& from) {
  CostEvaluation evaluation;
  const auto read = [&](auto& member) { from.read(member); };
  for_members_of_evaluation(evaluation, read);
  const auto frames = from.get<std::size_t>();
  for (std::size_t i = 0; i < frames; ++i) {
    FrameFit& frame = evaluation.frames.emplace_back();
    for_members_of_frame(frame, read);
    const auto count = from.get<std::size_t>();
    for (std::size_t k = 0; k < count; ++k) for_members_of_rows(frame.rows.emplace_back(), read);
  }
  return evaluation;
}

}  // namespace pliant
