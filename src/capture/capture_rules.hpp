#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "capture/capture.hpp"
#include "scene/toml_table.hpp"

namespace pliant {

/// What a rule sees: the capture as read so far, and where to complain.
struct RuleContext {
  const Capture& capture;
  TomlContext& toml;
};

/// One thing that a valid capture must satisfy. A rule skips what an earlier one or the reader found broken.
using Rule = void (*)(RuleContext&);

/// @name Words of the rules' complaints
/// @{
std::string text_of(double value, const char* unit);  ///< four digits and the unit
std::string text_of(const Vector3& v);                ///< "[x, y, z]" of four digits each
/// A key of the i-th entry of an array of tables, "name[i].key"; the entry itself without a key.
std::string item(const char* name, std::size_t i, const char* key = "");
/// @}

/// @name Rules about the facts alone
/// @{
void check_surface_is_solid(RuleContext&);
void check_object_size(RuleContext&);
void check_pose(RuleContext&);
void check_surface_noise(RuleContext&);
void check_mass_or_density(RuleContext&);
void check_gravity(RuleContext&);
void check_timing(RuleContext&);
void check_start_frame(RuleContext&);
void check_static(RuleContext&);
void check_initial_velocity(RuleContext&);
void check_release(RuleContext&);
void check_vertex_lists(RuleContext&);
void check_fixed_regions(RuleContext&);
void check_materials(RuleContext&);
void check_planes(RuleContext&);
void check_camera_names(RuleContext&);
void check_intrinsics(RuleContext&);
void check_lenses(RuleContext&);
void check_time_offsets(RuleContext&);
void check_moving_cameras(RuleContext&);
void check_every(RuleContext&);
void check_noise(RuleContext&);
void check_has_observations(RuleContext&);
void check_presses(RuleContext&);
void check_weights(RuleContext&);
void check_wind(RuleContext&);
void check_applied_forces(RuleContext&);
void check_loads(RuleContext&);
void check_indentations(RuleContext&);
void check_grips(RuleContext&);
void check_material_curves(RuleContext&);
/// @}

/// @name Rules that open the recording's files
/// @{
void check_depth_files(RuleContext&);
void check_clouds(RuleContext&);
void check_markers(RuleContext&);
void check_press_markers(RuleContext&);
void check_load_files(RuleContext&);
void check_curve_files(RuleContext&);
void check_grip_markers(RuleContext&);
void check_depth_scale(RuleContext&);
void check_cameras_see_object(RuleContext&);
void check_clouds_near_object(RuleContext&);
/// @}

/// All of them, in the order in which they are applied.
std::span<const Rule> capture_rules();

/// Frames that a sequence holds when it has one for every `every`-th of `frame_count`.
std::vector<int> frames_of(int frame_count, int every);

/// "3, 7-9, 12" from sorted numbers; with many runs the rest is counted.
std::string ranges_text(std::span<const int> numbers);

}  // namespace pliant
