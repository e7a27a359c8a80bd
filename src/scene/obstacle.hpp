#pragma once

#include <functional>
#include <ostream>
#include <span>
#include <vector>

#include "scene/scene.hpp"
#include "scene/toml_table.hpp"

// Rigid bodies that the object meets, and regions of it that are led: what they are as geometry, and their TOML, the
// same words in all formats that hold a scene (docs/formats.md).

namespace pliant {

/// Box around an obstacle where its motion is zero [m]; of a plane that of its point alone.
Box box_of(const RigidObstacle& obstacle);
/// An obstacle over time: turns are about the middle of its box, of a plane about its point.
KeyedMotion motion_of(const RigidObstacle& obstacle);
/// A led region over time: turns are about the middle of a box as far as it lies in the surface's own, the centre of a
/// sphere, and of other regions the middle of the box around the vertices that they contain.
KeyedMotion motion_of(const LedRegion& led, const TriangleMesh& surface);
/// An obstacle's surface where its motion is zero [m]; empty for a plane, which has no end.
TriangleMesh surface_of(const RigidObstacle& obstacle);

/// Distance [m] to an obstacle where its motion is zero, negative inside; of a mesh without sign.
std::function<double(const Vector3&)> distance_to(const RigidObstacle& obstacle);
/// How deep [m] the deepest of some points lies in an obstacle where its motion is zero; 0: none does.
double greatest_depth(const RigidObstacle& obstacle, std::span<const Vector3> points);

/// A rigid motion by its keys; none: it stands still.
KeyedMotion keyed_motion(const Vector3& centre, const std::vector<KeyFrames<6>::Key>& keys);

/// Blocks [[obstacle]] and [[led]].
/// @param may_be_unknown  whether a friction that is not written is one to be estimated; else it is none
RigidObstacle read_obstacle(TomlTable& block, const NamedFiles& files, bool may_be_unknown);
LedRegion read_led(TomlTable& block, const NamedFiles& files);
/// Keys of a rigid motion, in the table or in a file: motion = [ { time = 0, shift = [0, 0.1, 0], turn_deg = [0, 90, 0]
/// } ], or `motion_file`, a table with the header `time,x,y,z` or `time,x,y,z,turn_x,turn_y,turn_z` (metres, degrees).
std::vector<KeyFrames<6>::Key> read_motion(TomlTable& owner, const NamedFiles& files);
/// A form of a table of keys: its header, and how many numbers a line has beside its time; from the fourth on they are
/// those of a rotation vector in degrees.
struct KeyTable {
  const char* header;
  int numbers;
};
/// Appends the keys of a table in one of these forms, and says in which. Throws InputError with file, line and column
/// for another header, what is no number, and times that do not increase.
std::size_t read_key_table(const std::filesystem::path& file, std::span<const KeyTable> forms,
                           std::vector<KeyFrames<6>::Key>& keys);
/// Keys `from` and `until` [s].
void read_span(TomlTable& table, double& from, double& until);

/// The same blocks as text, and the files that the text refers to: `obstacle_0.ply`, ... and `led_0.txt`, ...
void write_obstacle_blocks(std::ostream& out, const Scene& scene);
void write_obstacle_files(const std::filesystem::path& folder, const Scene& scene);

}  // namespace pliant
