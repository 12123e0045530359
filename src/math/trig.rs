//! Trigonometry through `libm`: the same bits on every platform, which the standard library's
//! functions do not promise.

/// Sine of `angle` radians.
#[must_use]
pub fn sin(angle: f64) -> f64 {
    libm::sin(angle)
}

/// Cosine of `angle` radians.
#[must_use]
pub fn cos(angle: f64) -> f64 {
    libm::cos(angle)
}

/// Tangent of `angle` radians.
#[must_use]
pub fn tan(angle: f64) -> f64 {
    libm::tan(angle)
}
