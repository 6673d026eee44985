// ob_interior where the answer is known. Argument 1: the path of an Embree library.
#include "scenes.h"

static Mesh moved(Mesh mesh, float dx, float dy, float dz) {
  for (size_t i = 0; i < mesh.vertices.size(); i += 3) {
    mesh.vertices[i] += dx;
    mesh.vertices[i + 1] += dy;
    mesh.vertices[i + 2] += dz;
  }
  return mesh;
}

// The share of the target's texels inside what is in the scene; own: the number of its mesh there, or -1.
static double share(const Scene &scene, const Target &target, int32_t own, int32_t threads = 2) {
  std::vector<int64_t> texels;
  for (size_t i = 0; i < target.owner.size(); ++i) {
    if (target.owner[i] >= 0) {
      texels.push_back(static_cast<int64_t>(i));
    }
  }
  const ob_surface surface = target.surface();
  const auto count = static_cast<int64_t>(texels.size());
  std::vector<uint8_t> inside(texels.size(), 77);
  ob_control control{};
  must(ob_interior(scene.get(), &surface, own, texels.data(), count, threads, inside.data(), &control));
  CHECK_EQUAL(control.done, count);
  CHECK_EQUAL(control.total, count);
  double sum = 0.0;
  for (const uint8_t each : inside) {
    CHECK(each == 0 || each == 1);
    sum += each;
  }
  return sum / static_cast<double>(count);
}

static double share_among(const Device &device, const Mesh &own, const std::vector<Mesh> &others) {
  std::vector<Mesh> all = {own};
  all.insert(all.end(), others.begin(), others.end());
  return share(scene_of(device, all), Target(own, 24, 16), 0);
}

static void test_a_box_in_a_box(const Device &device) {
  for (const float scale : {1e-3F, 1.0F, 1e3F}) {
    const Mesh outer = turned(box(scale, scale, scale), 0.1F * scale);
    const Mesh inner = turned(box(0.3F * scale, 0.5F * scale, 0.2F * scale), 0.2F * scale);
    CHECK_EQUAL(share_among(device, inner, {outer}), 1);
    CHECK_EQUAL(share_among(device, outer, {inner}), 0);
    CHECK_EQUAL(share(scene_of(device, {outer}), Target(inner, 24, 16), -1), 1); // one that does not occlude itself
    CHECK_EQUAL(share_among(device, inner, {}), 0);
  }
}

// Upright and half sunk in the other: the bottom face and the lower half of four sides.
static void test_a_box_half_sunk(const Device &device) {
  CHECK_EQUAL(share_among(device, moved(box(0.5F, 0.5F, 0.5F), 0, 0, 1), {box(1, 1, 1)}), 0.5);
}

static void test_a_box_at_rest_touches_and_is_not_inside(const Device &device) {
  const Mesh rests = moved(box(0.5F, 0.5F, 0.5F), 0, 0, 1.5F);
  CHECK_EQUAL(share_among(device, rests, {box(1, 1, 1)}), 0);
  CHECK_EQUAL(share_among(device, box(1, 1, 1), {rests}), 0);
  CHECK_EQUAL(share_among(device, rests, {rests}), 0); // the same mesh twice
}

static void test_the_side_of_the_faces_decides(const Device &device) {
  CHECK_EQUAL(share_among(device, box(0.3F, 0.3F, 0.3F), {box(1, 1, 1, true)}), 0); // a room
  CHECK_EQUAL(share_among(device, box(1, 1, 1, true), {}), 0);                      // its own backs do not count
  CHECK_EQUAL(share_among(device, box(0.3F, 0.3F, 0.3F, true), {box(1, 1, 1)}), 1);
}

static void test_an_open_sheet_is_no_body(const Device &device) {
  const Mesh thing = box(0.5F, 0.5F, 0.5F);
  CHECK_EQUAL(share_among(device, thing, {square(0.6F, 1e3F)}), 0); // it sees the back of half of the world
  CHECK_EQUAL(share_among(device, thing, {square(-0.6F, 1e3F)}), 0);
  CHECK_EQUAL(share_among(device, square(0, 1), {square(0.01F, 1e3F), square(-0.01F, 1e3F)}), 0);
}

// Instances, some of them mirrored: outside remains outside.
static void test_instances(const Device &device) {
  const BuiltMesh out = build(device, box(1, 1, 1));
  const BuiltMesh in = build(device, box(1, 1, 1, true));
  const Target small(box(0.2F, 0.3F, 0.25F), 24, 16);
  for (const float mirror : {1.0F, -1.0F}) {
    const float matrix[] = {0.0F, -0.8F * mirror, 0.0F, 0.1F, 1.0F, 0.0F, 0.2F, 0.0F, 0.0F, 0.3F, 0.9F, -0.1F};
    const float flat[] = {0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    for (const BuiltMesh *mesh : {&out, &in}) {
      const Scene scene = begin_scene(device);
      must(add_instances(scene, mesh->get(), flat, 1)); // nothing: it hides no direction of any size
      must(add_instances(scene, mesh->get(), matrix, 1));
      must(add(scene, small.mesh));
      must(ob_scene_commit(scene.get(), nullptr));
      CHECK_EQUAL(share(scene, small, 2), mesh == &out ? 1 : 0);
      CHECK_EQUAL(share(scene, small, 2, 1), mesh == &out ? 1 : 0);
    }
  }
}

static void test_a_cancelled_call_says_so(const Device &device) {
  const Target target(box(1, 1, 1), 24, 16);
  const ob_surface surface = target.surface();
  const int64_t texel = 0;
  uint8_t inside = 77;
  ob_control control{1, 0, 0, 0};
  const Scene scene = scene_of(device, {target.mesh});
  CHECK_EQUAL(ob_interior(scene.get(), &surface, 0, &texel, 1, 1, &inside, &control), OB_CANCELLED);
  CHECK_EQUAL(inside, 77);
  must(ob_interior(scene.get(), &surface, 0, &texel, 0, 1, &inside, nullptr)); // of no texels there is nothing to say
  CHECK_EQUAL(inside, 77);
}

int main(int argc, char **argv) {
  if (argc < 2) {
    std::puts("SKIPPED: no Embree was named");
    return 0;
  }
  const Device device = open_device(argv[1]);
  test_a_box_in_a_box(device);
  test_a_box_half_sunk(device);
  test_a_box_at_rest_touches_and_is_not_inside(device);
  test_the_side_of_the_faces_decides(device);
  test_an_open_sheet_is_no_body(device);
  test_instances(device);
  test_a_cancelled_call_says_so(device);
}
