// Elementary functions of our own: the C libraries' differ from one system to another in their last bits, and textures
// would with them. They are series of plain arithmetic, whose every result IEEE 754 fixes, and err by a few units in
// the last place.
#pragma once

namespace ob::elementary {

inline constexpr double kPi = 0x1.921fb54442d18p+1;

double sin(double x); // up to a million either way; beyond that it is not a number
double cos(double x); // the same
double exp(double x);
double expm1(double x);                // exp(x) - 1, also near 0
double log(double x);                  // of numbers above 0
double log1p(double x);                // log(1 + x), also near 0; of numbers above -1
double pow(double x, double exponent); // of numbers above 0
double atan2(double y, double x);
double acos(double x); // of -1 to 1

} // namespace ob::elementary
