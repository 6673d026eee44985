#include "chart_insert.h"

#include "chart_visible.h"
#include "chart_wedge.h"

namespace ob::flatten {
namespace {

constexpr double kGoodEnough = 1.5; // energy over the least conceivable
constexpr int kMostSteps = 10;

using Wedges = std::array<Wedge, kMostSpokes>;

Vector2 place_of(Spread spread) { return {spread.x, spread.y}; }

// By how much larger the vertex's neighbours lie around it in the plane than where its star was spread, in area.
double area_scale(const Spread *spread, const Rim &rim) {
  const int32_t last = rim.count - 1;
  if (!rim.closed) { // by the edge across alone, which may be all there is
    return squared(rim.point[at(last)] - rim.point[0]) / squared(place_of(spread[last]) - place_of(spread[0]));
  }
  double in_plane = 0.0;
  double as_spread = 0.0;
  for (int32_t i = 0; i < rim.count; ++i) {
    const int32_t j = rim.after(i);
    in_plane += doubled_area(rim.point[0], rim.point[at(i)], rim.point[at(j)]);
    as_spread += cross(place_of(spread[i]), place_of(spread[j]));
  }
  return in_plane / as_spread;
}

// The star as it was spread, made as large as it is in the plane. Returns the least conceivable energy.
double fill_wedges(const Spread *spread, const Rim &rim, Wedges &wedges) {
  const double scale = area_scale(spread, rim);
  double least = 0.0;
  for (int32_t i = 0; i < rim.sides(); ++i) {
    const int32_t j = rim.after(i);
    const Vector2 a = place_of(spread[i]);
    const Vector2 b = place_of(spread[j]);
    const double doubled = cross(a, b);
    const double half = 0.5 / doubled;
    wedges[at(i)] = {rim.point[at(i)],     rim.point[at(j)],     half * dot(a, b),
                     half * dot(a - b, a), half * dot(b - a, b), scale * scale * doubled * doubled};
    least += 2.0 * scale * doubled;
  }
  return least;
}

} // namespace

bool put_back(const Hierarchy &hierarchy, const Removal &removal, std::vector<Vector2> &uv) {
  const int32_t *const neighbour = hierarchy.neighbours.data() + removal.first;
  const Spread *const spread = hierarchy.places.data() + removal.first;
  Rim rim{removal.spokes, removal.closed, {}};
  for (int32_t i = 0; i < rim.count; ++i) {
    rim.point[at(i)] = uv[at(neighbour[i])];
  }
  const Vector2 b = rim.point[at(removal.beside)];
  const Vector2 to_c = rim.point[at(rim.after(removal.beside))] - b;
  Vector2 &place = uv[at(removal.vertex)];
  if (removal.spokes == 2) {
    place = b + removal.weight.x * to_c + removal.weight.y * Vector2{-to_c.y, to_c.x};
    return sees_all(rim, place);
  }
  const Vector2 a = rim.point[at(removal.onto)];
  place = b + removal.weight.x * (a - b) + removal.weight.y * to_c;
  const bool seen = sees_all(rim, place);
  Wedges wedges;
  const double least = fill_wedges(spread, rim, wedges);
  const Wedge *const end = wedges.data() + rim.sides();
  if (seen && energy(place, wedges.data(), end) < kGoodEnough * least) {
    return true;
  }
  if (!seen && !find_kernel(rim, removal.onto, place)) {
    return false;
  }
  improve(place, wedges.data(), end, kMostSteps);
  return true;
}

} // namespace ob::flatten
