#include "report/gallery.hpp"

#include "geometry/primitives.hpp"
#include "rays/ray_scene.hpp"
#include "report/plot.hpp"

namespace pliant::gallery_test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

Gallery falling_ball() {
  Gallery gallery;
  const TriangleMesh ball = make_sphere(0.1, 2);
  gallery.triangles = ball.triangles;
  gallery.planes = {Plane{}};
  gallery.width = 60, gallery.height = 40;
  for (const int frame : {3, 9}) {
    const Vector3 centre(0, frame == 3 ? 0.5 : 0.1, 0);
    GalleryFrame& f = gallery.frames.emplace_back();
    f.frame = frame, f.time = frame / 60.0;
    f.surface = vertex_points(ball).rowwise() + centre.transpose();
    f.points = {centre + Vector3(0, 0.103, 0), centre + Vector3(0, 0.104, 0)};
    f.residuals = {0.003, 0.004};
  }
  return gallery;
}

TEST(SpreadFrames, IncludesBothEnds) {
  EXPECT_THAT(spread_frames(4, 63, 4), ElementsAre(4, 24, 43, 63));
  EXPECT_THAT(spread_frames(4, 5, 6), ElementsAre(4, 5));
  EXPECT_THAT(spread_frames(4, 9, 1), ElementsAre(4));
  EXPECT_TRUE(spread_frames(4, 3, 2).empty());
}

TEST(Gallery, CaptionsTellTimeAgreementAndScale) {
  const auto pictures = draw_gallery(falling_ball());
  ASSERT_EQ(pictures.size(), 2u);
  EXPECT_EQ(pictures[0].caption, "Frame 3, 0.05 s: 2 points, 3.5 mm rms; grid 50 mm");
  EXPECT_THAT(pictures[1].caption, HasSubstr("Frame 9, 0.15 s"));
  EXPECT_NE(pictures[0].png, pictures[1].png);
  EXPECT_EQ(all_residuals(falling_ball()).size(), 4u);
}

TEST(Gallery, FramesShareOneViewThatHoldsTheWholeMotion) {
  Gallery gallery = falling_ball();
  const auto both = draw_gallery(gallery);
  gallery.frames.pop_back();
  EXPECT_NE(draw_gallery(gallery)[0].png, both[0].png);  // alone it is framed closer
  EXPECT_TRUE(draw_gallery(Gallery{}).empty());
}

TEST(Gallery, DrawsANumberInColoursWithItsRange) {
  const TriangleMesh ring = make_torus(0.15, 0.06, 32, 16);
  Gallery gallery;
  gallery.triangles = ring.triangles;
  gallery.width = 120, gallery.height = 90;
  std::vector<FieldState> states;
  for (const double factor : {1.0, 2.0}) {
    FieldState& state = states.emplace_back(FieldState{vertex_points(ring), {}, "times " + readable(factor)});
    for (const Vector3& v : ring.vertices) state.values.push_back(factor * (2500.0 + 1e4 * v.x()));
  }
  ReportField field = draw_field(gallery, states, "stress", "Pa", ScaleEnds::All);
  EXPECT_NEAR(field.scale.low, 2500.0 - 2100.0, 1e-9);
  EXPECT_NEAR(field.scale.high, 2.0 * (2500.0 + 2100.0), 1e-9);
  ASSERT_EQ(field.pictures.size(), 2u);
  EXPECT_NE(field.pictures[0].png, field.pictures[1].png) << "one scale for both";
  field.abscissa = "time [s]", field.at = {0.0, 1.0}, field.greatest = {4600.0, 9200.0}, field.mean = {2500.0, 5000.0};
  ReportData data;
  data.fields = {field};
  for (const std::string& page : {report_html(data), fields_html("a ring", {field})}) {
    EXPECT_THAT(page, HasSubstr("Fields over the object"));
    EXPECT_THAT(page, HasSubstr("stress [Pa]"));
    EXPECT_THAT(page, HasSubstr("times 2"));
    EXPECT_THAT(page, HasSubstr(">5000</text>"));
    EXPECT_THAT(page, HasSubstr("mean by volume"));
  }
  states[1].values.pop_back();
  EXPECT_THROW((void)draw_field(gallery, states, "stress", "Pa", ScaleEnds::All), std::invalid_argument);
}

}  // namespace
}  // namespace pliant::gallery_test
