/* Positions and forces between a bundle's frame (LPS, right-handed, z up, metres) and two game engines. */
#ifndef FRAMES_H
#define FRAMES_H

/* Unity: left-handed, y up, metres. Forces alike, in newtons. */
static inline void unity_from_lps(const double lps[3], float unity[3]) {
  unity[0] = (float)lps[0], unity[1] = (float)lps[2], unity[2] = (float)lps[1];
}
static inline void lps_from_unity(const float unity[3], double lps[3]) {
  lps[0] = unity[0], lps[1] = unity[2], lps[2] = unity[1];
}

/* Unreal: left-handed, z up, centimetres, x forward. Forces: the same axes, but in newtons, without the factor 100. */
static inline void unreal_from_lps(const double lps[3], double unreal[3]) {
  unreal[0] = 100 * lps[1], unreal[1] = 100 * lps[0], unreal[2] = 100 * lps[2];
}
static inline void lps_from_unreal(const double unreal[3], double lps[3]) {
  lps[0] = unreal[1] / 100, lps[1] = unreal[0] / 100, lps[2] = unreal[2] / 100;
}

/* 3D Slicer and OpenIGTLink: RAS, millimetres. */
static inline void ras_from_lps(const double lps[3], double ras[3]) {
  ras[0] = -1000 * lps[0], ras[1] = -1000 * lps[1], ras[2] = 1000 * lps[2];
}

#endif
