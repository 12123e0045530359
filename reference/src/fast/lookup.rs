//! Corners of triangles from a table of a cluster's vertices. The one place that names instructions of
//! a machine: a table of 64 words is four registers, and two shuffles and a blend look up sixteen.

use fearless_simd::Simd;

use super::level::LANES;
use super::mesh::CLUSTER_VERTICES;

/// `out[i] = table[places[i]]` for as many as a multiple of sixteen.
#[inline(always)]
pub(crate) fn corners<S: Simd>(
    s: S,
    table: &[u32; CLUSTER_VERTICES],
    places: &[u8],
    out: &mut [u32],
) {
    #[cfg(target_arch = "x86_64")]
    if let Some(avx512) = s.level().as_avx512() {
        for (places, out) in places.chunks_exact(LANES).zip(out.chunks_exact_mut(LANES)) {
            wide(avx512, table, places, out);
        }
        return;
    }
    for (place, out) in places.iter().zip(out) {
        *out = table[usize::from(*place) % CLUSTER_VERTICES];
    }
}

#[cfg(target_arch = "x86_64")]
fearless_simd::kernel!(
    #[inline]
    fn wide(avx512: Avx512, table: &[u32; 64], places: &[u8], out: &mut [u32]) {
        use std::arch::x86_64::{
            __m512i, _mm512_cvtepu8_epi32, _mm512_mask_blend_epi32, _mm512_permutex2var_epi32,
            _mm512_set1_epi32, _mm512_test_epi32_mask,
        };

        use fearless_simd::prelude::*;
        use fearless_simd::{u8x16, u32x16};

        let part = |i: usize| -> __m512i {
            u32x16::from_slice(avx512, &table[16 * i..16 * i + 16]).into()
        };
        let places = _mm512_cvtepu8_epi32(u8x16::from_slice(avx512, places).into());
        let low = _mm512_permutex2var_epi32(part(0), places, part(1));
        let high = _mm512_permutex2var_epi32(part(2), places, part(3));
        let upper = _mm512_test_epi32_mask(places, _mm512_set1_epi32(32));
        let found: u32x16<_> = _mm512_mask_blend_epi32(upper, low, high).simd_into(avx512);
        found.store_slice(out);
    }
);
