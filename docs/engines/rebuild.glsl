// Reflection occlusion for any view from what Occlusion Bake keeps of a texel; docs/directional.md has the formulas.
//
// r: the reflected direction in the frame of the texel, a unit vector: x the tangent, y the bitangent, z the normal.
// exponent: of the Phong lobe, (e + 1) / (2 pi) cos^e; of a GGX or Beckmann width alpha it is 2 / alpha^2 - 2.
// lobes: lobe_image() as a texture of floats, linear, not repeated, without mip maps (where r turns within pixels they
// would blur the terms into one another), its first row at v = 0 (0.5 / 64 is its middle).
// All return RO, which is less than 1 over an open surface as well, where the lobe meets the horizon: divided by
// occlusion_open, an open texel is 1 from every view.

const float OCCLUSION_SIDE = 64.0;
const float OCCLUSION_TILES = 4.0;

vec3 occlusion_terms(sampler2D lobes, float tile, vec2 place) {
    vec2 at = (place * (OCCLUSION_SIDE - 1.0) + 0.5) / OCCLUSION_SIDE;
    return texture(lobes, vec2((at.x + tile) / OCCLUSION_TILES, at.y)).rgb;
}

vec2 occlusion_place(vec3 r, float exponent) {
    return vec2(clamp(r.z, 0.0, 1.0), sqrt(2.0 / (exponent + 2.0)));
}

// What an open surface gets.
float occlusion_open(vec3 r, float exponent, sampler2D lobes) {
    return 3.5449077 * occlusion_terms(lobes, 0.0, occlusion_place(r, exponent)).r;
}

// code: the coefficients of degree 3, in their order.
float occlusion_from_harmonics(float code[16], vec3 r, float exponent, sampler2D lobes) {
    vec2 place = occlusion_place(r, exponent);
    vec3 a = occlusion_terms(lobes, 0.0, place);
    vec3 b = occlusion_terms(lobes, 1.0, place);
    vec3 c = occlusion_terms(lobes, 2.0, place);
    vec3 d = occlusion_terms(lobes, 3.0, place);
    vec2 one = vec2(r.x, r.y);
    vec2 two = vec2(one.x * one.x - one.y * one.y, 2.0 * one.x * one.y);
    vec2 three = vec2(one.x * two.x - one.y * two.y, one.x * two.y + one.y * two.x);
    float sum = a.r * code[0] + a.g * code[2] + a.b * code[6] + b.r * code[12];
    sum += dot(one, vec2(code[3], code[1]) * b.g + vec2(code[7], code[5]) * b.b + vec2(code[13], code[11]) * c.r);
    sum += dot(two, vec2(code[8], code[4]) * c.g + vec2(code[14], code[10]) * c.b);
    sum += dot(three, vec2(code[15], code[9])) * d.r;
    return clamp(sum, 0.0, 3.5449077 * a.r);
}

// The middle of a cell of 8 x 8.
vec3 occlusion_cell(int column, int row) {
    vec2 p = vec2(float(column), float(row)) * 0.25 - 0.875;
    bool wide = abs(p.x) > abs(p.y);
    float radius = wide ? p.x : p.y;
    float turn = 0.78539816 * (wide ? p.y / p.x : p.x / p.y);
    float angle = wide ? turn : 1.57079633 - turn;
    float sine = radius * sqrt(2.0 - radius * radius);
    return vec3(sine * cos(angle), sine * sin(angle), 1.0 - radius * radius);
}

// mask: 8 x 8 cells, x the bytes of rows 0 to 3 and y those of rows 4 to 7, the least first. In place of integrals over
// cells the lobe is widened by a sixth of a cell's solid angle, and taken at their middles.
float occlusion_from_mask(uvec2 mask, vec3 r, float exponent, sampler2D lobes) {
    float widened = exponent / (1.0 + exponent * 0.016362462);
    float open = 0.0;
    float whole = 0.0;
    for (int k = 0; k < 64; ++k) {
        float cosine = dot(r, occlusion_cell(k & 7, k >> 3));
        float weight = cosine > 0.0 ? pow(cosine, widened) : 0.0;
        uint bits = k < 32 ? mask.x : mask.y;
        whole += weight;
        open += ((bits >> uint(k & 31)) & 1u) != 0u ? weight : 0.0;
    }
    return occlusion_open(r, exponent, lobes) * open / whole;
}
