#pragma once
/// Noise and point spread of a phantom; for use in this folder.
#include <cstdint>

#include "preprocess/volume/image.h"

namespace wireplan::preprocess {

/// Adds noise of sigma `noise_hu` from the seed, and blurs the image with a Gaussian of sigma
/// `blur_mm`, which correlates the noise. The same bits at any thread count.
void add_noise_and_blur(double noise_hu, std::uint64_t seed, double blur_mm, Image& image);

/// Blurs the image with a Gaussian of sigma `blur_mm`.
void blur(double blur_mm, Image& image);

/// Adds noise of sigma `noise_hu` with the texture of a reconstruction kernel: in each slice white
/// noise, blurred by sigma `texture_mm`, less the same blurred by twice that. The same bits at any
/// thread count.
void add_textured_noise(double noise_hu, std::uint64_t seed, double texture_mm, Image& image);

}  // namespace wireplan::preprocess
