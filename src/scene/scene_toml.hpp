#pragma once

#include <filesystem>
#include <ostream>
#include <string>

#include "scene/scene.hpp"
#include "scene/toml_table.hpp"

// Scenes in TOML, the same words in all formats that hold one (docs/formats.md): captures, models, synthetic scenes and
// sessions of photographs. A reader asks a table for its keys; who opened the table finishes it, and may ask for more.
// What is missing or makes no sense is a complaint in the table's context, and a default in the value.

namespace pliant {

/// Keys of [object] that every format has: `mass`, `density`, `shape_is`.
void read_object_facts(TomlTable& table, Object& object);
/// Key `surface` or `volume_mesh` of [object], neither required: the file's path and its mesh.
void read_object_shape(TomlTable& table, const NamedFiles& files, Object& object);
/// Complains where both or neither of `mass` and `density` is written.
void require_mass_or_density(TomlTable& table);

/// Table [world]. @param gravity_is_required  false: gravity may be unknown
World read_world(TomlTable& table, bool gravity_is_required = false);

/// Table [timing] of a recording: `frame_rate` or a file of `timestamps`, `frame_count`, `start_frame`, `static`.
Timing read_timing(TomlTable& table, const NamedFiles& files);
/// Table [timing] where frames are equally spaced: `frame_rate`, `frame_count`, `start_frame`.
Timing read_even_timing(TomlTable& table, int most_frames);

/// A region: one of `box`, `sphere`, `half_space`, `vertices` (a file with one index a line).
std::optional<Region> read_region(TomlTable& table, const NamedFiles& files);

/// Complains about vertices in the lists of [[fixed]], [[led]] and [[region]] that the surface has not; about none
/// without surface.
void check_vertex_lists(TomlContext& context, const Scene& scene);
/// Complains about names in [[region]] and [[control]] that are not their own, regions without a point of the object,
/// control points together with regions, and weights that do not suit the surface.
void check_materials(TomlContext& context, const Scene& scene);

/// Blocks [[fixed]], [[region]], [[control]], [[plane]], [[weight]]; and any table with a weight's keys.
FixedRegion read_fixed(TomlTable& block, const NamedFiles& files);
MaterialRegion read_material_region(TomlTable& block, const NamedFiles& files);
MaterialControl read_material_control(TomlTable& block, const NamedFiles& files);
Plane read_plane(TomlTable& block);
Weight read_weight(TomlTable& block);

/// Keys of one vector over time, such as [ { time = 0, force = [0, 1, 0] } ].
/// @param value  the vector's name in each: "force"
std::vector<KeyFrames<3>::Key> read_key_frames(TomlTable& owner, const std::string& name, const std::string& value);
/// Complains where times [s] of a list of keys do not increase.
void check_key_times(TomlTable& owner, const std::string& name, const std::vector<double>& times);
/// Keys `at` and `radius` of a patch of the surface at rest [m].
void read_patch(TomlTable& table, Vector3& at, double& radius);
/// Table [wind], blocks [[force]]. @param may_be_unknown  whether the format has the key `known`
WindFacts read_wind(TomlTable& table, bool may_be_unknown);
AppliedForce read_force(TomlTable& block, bool may_be_unknown);

/// Table [initial]. @param may_pull  whether the format has the key `pulls`
Initial read_initial(TomlTable& table, bool may_pull = false);

/// The same tables and blocks as text, each with an empty line behind it. Times that are not equally spaced, and lists
/// of vertices, are files: see `write_scene_files`.
void write_toml(std::ostream& out, const World& world);
void write_toml(std::ostream& out, const Timing& timing);
void write_toml(std::ostream& out, const Initial& initial);
void write_toml(std::ostream& out, const Plane& plane);
void write_toml(std::ostream& out, const Weight& weight);
void write_toml(std::ostream& out, const WindFacts& wind);
void write_toml(std::ostream& out, const AppliedForce& force);

/// Table [object]. @param file  path of the surface or volume mesh as it shall be written; empty: of neither
void write_toml(std::ostream& out, const Object& object, const std::string& file);

/// A region as text, for a block of another format. @param vertices_file  where a list of vertices shall stand
void write_region(std::ostream& out, const Region& region, const std::string& vertices_file);
/// Writes that file where the region is a list of vertices. Throws InputError where it cannot be written.
void write_region_file(const std::filesystem::path& file, const Region& region);

/// Blocks [[plane]], [[inner]], [[obstacle]], [[led]], [[fixed]], [[region]], [[control]], [[weight]] and [[force]],
/// and the table [wind] of a scene.
void write_toml_blocks(std::ostream& out, const Scene& scene);

/// Writes what the text refers to and the value itself holds: `fixed_0.txt`, `region_0.txt`, ... with the vertices of a
/// region that lists them, by its number, `control_0.txt`, ... with the weights of a control point, `inner_0.ply`,
/// ... with inner bodies, `obstacle_0.ply`, ... with obstacles that are meshes, and `timestamps.txt` [s]. Throws
/// InputError where a file cannot be written.
void write_scene_files(const std::filesystem::path& folder, const Scene& scene);

}  // namespace pliant
