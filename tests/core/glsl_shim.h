// As much of GLSL in C++ as docs/engines/rebuild.glsl uses, so that its very text can be compiled and run.
#pragma once
#include <cmath>

namespace glsl {

using uint = unsigned;

struct vec2 {
  float x, y;
  vec2(float a, float b) : x(a), y(b) {}
};
struct vec3 {
  union {
    float x, r;
  };
  union {
    float y, g;
  };
  union {
    float z, b;
  };
  vec3(float a, float c, float d) : x(a), y(c), z(d) {}
};
struct uvec2 {
  uint x, y;
};
struct vec4 {
  vec3 rgb;
};

inline vec2 operator+(vec2 a, vec2 b) { return {a.x + b.x, a.y + b.y}; }
inline vec2 operator+(vec2 a, float b) { return {a.x + b, a.y + b}; }
inline vec2 operator-(vec2 a, float b) { return {a.x - b, a.y - b}; }
inline vec2 operator*(vec2 a, float b) { return {a.x * b, a.y * b}; }
inline vec2 operator/(vec2 a, float b) { return {a.x / b, a.y / b}; }
inline vec3 operator+(vec3 a, vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline vec3 operator*(vec3 a, float b) { return {a.x * b, a.y * b, a.z * b}; }
inline float dot(vec2 a, vec2 b) { return a.x * b.x + a.y * b.y; }
inline float dot(vec3 a, vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline float abs(float a) { return std::fabs(a); }
inline float sqrt(float a) { return std::sqrt(a); }
inline float pow(float a, float b) { return std::pow(a, b); }
inline float sin(float a) { return std::sin(a); }
inline float cos(float a) { return std::cos(a); }
inline float clamp(float a, float low, float high) { return a < low ? low : (a > high ? high : a); }

// RGB floats, the row of v = 0 first; linear, clamped to the edge.
struct sampler2D {
  const float *texels;
  int width, height;
  vec3 at(int column, int row) const {
    const int x = column < 0 ? 0 : (column < width ? column : width - 1);
    const int y = row < 0 ? 0 : (row < height ? row : height - 1);
    const float *texel = texels + 3 * (y * width + x);
    return {texel[0], texel[1], texel[2]};
  }
};

inline vec4 texture(const sampler2D &image, vec2 place) {
  const float x = place.x * static_cast<float>(image.width) - 0.5F;
  const float y = place.y * static_cast<float>(image.height) - 0.5F;
  const int column = static_cast<int>(std::floor(x));
  const int row = static_cast<int>(std::floor(y));
  const float right = x - static_cast<float>(column);
  const float down = y - static_cast<float>(row);
  const vec3 above = image.at(column, row) * (1.0F - right) + image.at(column + 1, row) * right;
  const vec3 below = image.at(column, row + 1) * (1.0F - right) + image.at(column + 1, row + 1) * right;
  return {above * (1.0F - down) + below * down};
}

} // namespace glsl
