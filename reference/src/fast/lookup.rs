//! Corners of triangles from a table of a cluster's vertices. The one place that names instructions of
//! a machine: a table of 64 words is four registers, and two shuffles and a blend look up sixteen.

use fearless_simd::Simd;

#[cfg(target_arch = "x86_64")]
use super::level::LANES;
use super::mesh::CLUSTER_VERTICES;

/// For each word of three places (see [`View::corners`](super::mesh::View)), as many as a multiple of
/// sixteen, what the table has there, by corner.
#[inline(always)]
pub(crate) fn corners<S: Simd, const SLOTS: usize>(
    s: S,
    table: &[u32; CLUSTER_VERTICES],
    places: &[u32],
    out: &mut [[u32; SLOTS]; 3],
) {
    // Without shuffles of two registers it is a plain loop.
    let _ = s;
    #[cfg(target_arch = "x86_64")]
    if let Some(avx512) = s.level().as_avx512() {
        let [a, b, c] = out;
        let sixteens = a.chunks_exact_mut(LANES).zip(b.chunks_exact_mut(LANES));
        let sixteens = sixteens.zip(c.chunks_exact_mut(LANES));
        for (places, ((a, b), c)) in places.chunks_exact(LANES).zip(sixteens) {
            wide(avx512, table, places, a, b, c);
        }
        return;
    }
    for (i, &word) in places.iter().enumerate().take(SLOTS) {
        let place = |corner: usize| (word >> (8 * corner)) as usize & (CLUSTER_VERTICES - 1);
        out[0][i] = table[place(0)];
        out[1][i] = table[place(1)];
        out[2][i] = table[place(2)];
    }
}

#[cfg(target_arch = "x86_64")]
fearless_simd::kernel!(
    #[inline]
    fn wide(
        avx512: Avx512,
        table: &[u32; 64],
        places: &[u32],
        a: &mut [u32],
        b: &mut [u32],
        c: &mut [u32],
    ) {
        use std::arch::x86_64::{
            __m512i, _mm512_mask_blend_epi32, _mm512_permutex2var_epi32, _mm512_set1_epi32,
            _mm512_srli_epi32, _mm512_test_epi32_mask,
        };

        use fearless_simd::prelude::*;
        use fearless_simd::u32x16;

        let part = |i: usize| -> __m512i {
            u32x16::from_slice(avx512, &table[16 * i..16 * i + 16]).into()
        };
        let parts = [part(0), part(1), part(2), part(3)];
        let places: __m512i = u32x16::from_slice(avx512, places).into();
        let bit = _mm512_set1_epi32(32);
        // A shuffle of two registers looks at five bits; the sixth chooses between two shuffles.
        let find = |places: __m512i, out: &mut [u32]| {
            let low = _mm512_permutex2var_epi32(parts[0], places, parts[1]);
            let high = _mm512_permutex2var_epi32(parts[2], places, parts[3]);
            let upper = _mm512_test_epi32_mask(places, bit);
            let found: u32x16<_> = _mm512_mask_blend_epi32(upper, low, high).simd_into(avx512);
            found.store_slice(out);
        };
        find(places, a);
        find(_mm512_srli_epi32::<8>(places), b);
        find(_mm512_srli_epi32::<16>(places), c);
    }
);
