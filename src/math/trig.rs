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

#[cfg(test)]
mod tests {
    #[test]
    fn angles_are_radians() {
        let near = |a: f64, b: f64| (a - b).abs() < 1e-15;
        assert!(near(super::sin(0.5), 0.479_425_538_604_203));
        assert!(near(super::cos(0.5), 0.877_582_561_890_372_7));
        assert!(near(super::tan(0.5), 0.546_302_489_843_790_5));
    }
}
