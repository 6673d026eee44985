#include "chart_simplify_patches.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <queue>
#include <tuple>
#include <utility>

namespace ob::simplify {
namespace {

// A triangle is looked for no farther than this many steps from where its collapses have left it.
constexpr int kMostSteps = 64;
// How far a triangle is from one that it does not turn the same way as: this share of its area counts, by the cosine,
// beside the squared distance. It tells apart the two sides of a crease, which are equally far from what lies past it.
constexpr double kTurnShare = 0.5;

double squared_distance(Vector3 p, Vector3 a, Vector3 b) {
  const Vector3 along = b - a;
  const double length = squared(along);
  const double part = length > 0.0 ? std::clamp(dot(p - a, along) / length, 0.0, 1.0) : 0.0;
  return squared(p - (a + part * along));
}

double squared_distance(Vector3 p, const std::array<Vector3, 3> &triangle) {
  const auto &[a, b, c] = triangle;
  const Vector3 n = cross(b - a, c - a);
  const double area = squared(n);
  const bool over =
      dot(cross(b - a, p - a), n) >= 0.0 && dot(cross(c - b, p - b), n) >= 0.0 && dot(cross(a - c, p - c), n) >= 0.0;
  if (over && area > 0.0) {
    const double height = dot(n, p - a);
    return height * height / area;
  }
  return std::min({squared_distance(p, a, b), squared_distance(p, b, c), squared_distance(p, c, a)});
}

// The area, in the direction of the normal.
Vector3 area_vector(const std::array<Vector3, 3> &triangle) {
  return 0.5 * cross(triangle[1] - triangle[0], triangle[2] - triangle[0]);
}

Vector3 unit_normal(const std::array<Vector3, 3> &triangle) {
  const Vector3 outward = area_vector(triangle);
  const double size = length(outward);
  return size > 0.0 ? (1.0 / size) * outward : Vector3{0.0, 0.0, 0.0};
}

// What there is to know of a face that looks for its patch.
struct Seeker {
  Vector3 middle, outward;
  double area;
};

// The faces that are left, numbered anew.
struct Left {
  std::vector<int32_t> faces;
  std::vector<std::array<Vector3, 3>> corners;
  std::vector<Vector3> normal; // unit, or 0 where there is no area
  std::vector<int32_t> mate;   // as MeshEdges has it
};

Left gather_left(const CollapseMesh &mesh, LoopWatch &watch) {
  Left left;
  std::vector<int32_t> triangles;
  std::vector<uint8_t> lines;
  for (int32_t f = 0; f < mesh.face_count(); ++f) {
    watch.look();
    const Face &face = mesh.face(f);
    if (face.is_gone()) {
      continue;
    }
    left.faces.push_back(f);
    left.corners.push_back({mesh.node(face.vertex[0]).at, mesh.node(face.vertex[1]).at, mesh.node(face.vertex[2]).at});
    left.normal.push_back(unit_normal(left.corners.back()));
    for (int32_t side = 0; side < 3; ++side) {
      triangles.push_back(face.vertex[side]);
      lines.push_back(face.is_line(side) ? 1 : 0);
    }
  }
  left.mate = find_edges(triangles, lines, mesh.node_count(), watch).mate;
  return left;
}

class PatchMaker {
public:
  PatchMaker(const CollapseMesh &mesh, const OrderedMesh &whole, const MeshEdges &edges, LoopWatch &watch)
      : mesh_(mesh), whole_(whole), mate_(edges.mate), watch_(watch), left_(gather_left(mesh, watch)) {}

  Patches run() {
    follow_collapses();
    for (int32_t f = 0; f < mesh_.face_count(); ++f) {
      watch_.look();
      patch(f) = nearest(seeker(f), patch(f));
    }
    fill_empty();
    find_parts();
    keep_largest_parts();
    grow();
    return named();
  }

private:
  int32_t &patch(int32_t f) { return patch_[static_cast<size_t>(f)]; }
  int32_t &part(int32_t f) { return part_[static_cast<size_t>(f)]; }

  void follow_collapses() {
    patch_.assign(static_cast<size_t>(mesh_.face_count()), -1);
    for (size_t i = 0; i < left_.faces.size(); ++i) {
      patch(left_.faces[i]) = static_cast<int32_t>(i);
    }
    std::vector<int32_t> path;
    for (int32_t f = 0; f < mesh_.face_count(); ++f) {
      watch_.look();
      int32_t end = f;
      while (patch(end) < 0) {
        path.push_back(end);
        end = mesh_.face(end).into;
      }
      for (const int32_t each : path) {
        patch(each) = patch(end);
      }
      path.clear();
    }
  }

  Seeker seeker(int32_t f) const {
    const int32_t *corner = &whole_.triangles[3 * static_cast<size_t>(f)];
    const std::array<Vector3, 3> at{mesh_.node(corner[0]).at, mesh_.node(corner[1]).at, mesh_.node(corner[2]).at};
    const Vector3 outward = area_vector(at);
    return {(1.0 / 3.0) * (at[0] + at[1] + at[2]), outward, length(outward)};
  }

  double distance(const Seeker &seeker, int32_t patch) const {
    const auto i = static_cast<size_t>(patch);
    const double turned = seeker.area - dot(seeker.outward, left_.normal[i]);
    return squared_distance(seeker.middle, left_.corners[i]) + kTurnShare * std::max(turned, 0.0);
  }

  // Walks over the simplified mesh to where the face is nearer than to all triangles around.
  int32_t nearest(const Seeker &seeker, int32_t patch) const {
    double least = distance(seeker, patch);
    for (int step = 0; step < kMostSteps; ++step) {
      const int32_t from = patch;
      for (int32_t side = 0; side < 3; ++side) {
        const int32_t mate = left_.mate[3 * static_cast<size_t>(from) + static_cast<size_t>(side)];
        const double there = mate >= 0 ? distance(seeker, mate / 3) : least;
        if (there < least) {
          least = there;
          patch = mate / 3;
        }
      }
      if (patch == from) {
        break;
      }
    }
    return patch;
  }

  // A patch that no face is nearest to takes the face of its own, which may leave another empty.
  void fill_empty() {
    std::vector<int32_t> faces(left_.faces.size(), 0);
    for (const int32_t each : patch_) {
      watch_.look();
      ++faces[static_cast<size_t>(each)];
    }
    for (size_t i = 0; i < faces.size(); ++i) {
      for (auto empty = static_cast<int32_t>(i); faces[static_cast<size_t>(empty)] == 0;) {
        const int32_t robbed = std::exchange(patch(left_.faces[static_cast<size_t>(empty)]), empty);
        ++faces[static_cast<size_t>(empty)];
        --faces[static_cast<size_t>(robbed)];
        empty = robbed;
      }
    }
  }

  // Connected parts of patches, numbered in the order of their first faces.
  void find_parts() {
    part_.assign(patch_.size(), -1);
    std::vector<int32_t> stack;
    for (int32_t first = 0; first < mesh_.face_count(); ++first) {
      if (part(first) >= 0) {
        continue;
      }
      const auto number = static_cast<int32_t>(first_.size());
      first_.push_back(first);
      size_.push_back(0);
      part(first) = number;
      stack.push_back(first);
      while (!stack.empty()) {
        watch_.look();
        const int32_t f = stack.back();
        stack.pop_back();
        ++size_.back();
        for (const int32_t other : around(f)) {
          if (other >= 0 && part(other) < 0 && patch(other) == patch(f)) {
            part(other) = number;
            stack.push_back(other);
          }
        }
      }
    }
  }

  // The faces of other parts are left without a patch.
  void keep_largest_parts() {
    largest_.assign(left_.faces.size(), -1);
    for (size_t i = 0; i < first_.size(); ++i) {
      int32_t &largest = largest_[static_cast<size_t>(patch(first_[i]))];
      if (largest < 0 || size_[i] > size_[static_cast<size_t>(largest)]) {
        largest = static_cast<int32_t>(i);
      }
    }
    for (int32_t f = 0; f < mesh_.face_count(); ++f) {
      watch_.look();
      if (part(f) != largest_[static_cast<size_t>(patch(f))]) {
        part(f) = -1;
      }
    }
  }

  // Faces without a patch go to one beside them: first all that turn about the same way as it does, the nearest first.
  // So a fan's needles, each of which lies beside a patch past the crease too, are reached along the fan.
  void grow() {
    for (int32_t f = 0; f < mesh_.face_count(); ++f) {
      watch_.look();
      if (part(f) >= 0) {
        offer(f);
      }
    }
    while (!offers_.empty()) {
      watch_.look();
      const auto [is_turned, distance, f, giver] = offers_.top();
      offers_.pop();
      if (part(f) < 0) {
        part(f) = part(giver);
        patch(f) = patch(giver);
        offer(f);
      }
    }
  }

  void offer(int32_t f) {
    for (const int32_t other : around(f)) {
      if (other >= 0 && part(other) < 0) {
        const Seeker seeking = seeker(other);
        const double along = dot(seeking.outward, left_.normal[static_cast<size_t>(patch(f))]);
        offers_.emplace(along < 0.5 * seeking.area, distance(seeking, patch(f)), other, f);
      }
    }
  }

  std::array<int32_t, 3> around(int32_t f) const {
    std::array<int32_t, 3> faces{};
    for (size_t side = 0; side < 3; ++side) {
      const int32_t mate = mate_[3 * static_cast<size_t>(f) + side];
      faces[side] = mate >= 0 ? mate / 3 : -1;
    }
    return faces;
  }

  Patches named() {
    Patches patches{std::move(patch_), std::vector<int32_t>(part_.size(), -1)};
    std::vector<int32_t> name(left_.faces.size());
    for (size_t i = 0; i < name.size(); ++i) {
      name[i] = first_[static_cast<size_t>(largest_[i])];
      patches.left[static_cast<size_t>(name[i])] = left_.faces[i];
    }
    for (int32_t &root : patches.root) {
      root = name[static_cast<size_t>(root)];
    }
    return patches;
  }

  // Whether it turns another way, how far off it is, which face, and from which face beside it.
  using Offer = std::tuple<bool, double, int32_t, int32_t>;

  const CollapseMesh &mesh_;
  const OrderedMesh &whole_;
  const std::vector<int32_t> &mate_;
  LoopWatch &watch_;
  Left left_;
  std::vector<int32_t> patch_;        // of each face, a place in left_.faces
  std::vector<int32_t> part_;         // of each face, -1: it has no patch yet
  std::vector<int32_t> first_, size_; // of each part
  std::vector<int32_t> largest_;      // of each patch, one of its parts
  std::priority_queue<Offer, std::vector<Offer>, std::greater<>> offers_;
};

} // namespace

Patches assign_patches(const CollapseMesh &mesh, const OrderedMesh &whole, const MeshEdges &edges, LoopWatch &watch) {
  if (mesh.left() == mesh.face_count()) { // of loose triangles, say
    std::vector<int32_t> own(static_cast<size_t>(mesh.face_count()));
    std::iota(own.begin(), own.end(), 0);
    return {own, own};
  }
  return PatchMaker(mesh, whole, edges, watch).run();
}

} // namespace ob::simplify
