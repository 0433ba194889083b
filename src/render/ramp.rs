//! Colours for numbers.

/// Ends of the ramp in Oklab (Ottosson 2020): lightness, and a (green to red) and b (blue to yellow).
const LOW: [f64; 3] = [0.30, 0.02, -0.13];
const MIDDLE: [f64; 3] = [0.61, -0.08, -0.02];
const HIGH: [f64; 3] = [0.92, -0.02, 0.13];

/// The colour (linear red, green, blue, 0 to 1) of a number from 0 to 1: from dark blue over green to pale yellow. Equal steps of the
/// number are equal steps of lightness, so the order of values is visible in grey too. Numbers outside, and NaN, count as 0 or 1.
pub(super) fn ramp(number: f64) -> [f32; 3] {
    let number = if number.is_nan() { 0.0 } else { number.clamp(0.0, 1.0) };
    let (from, to, part) =
        if number < 0.5 { (LOW, MIDDLE, 2.0 * number) } else { (MIDDLE, HIGH, 2.0 * number - 1.0) };
    let [l, a, b] = [0, 1, 2].map(|n| from[n] + (to[n] - from[n]) * part);
    let cube = |value: f64| value * value * value;
    let l_ = cube(l + 0.396_337_777_4 * a + 0.215_803_757_3 * b);
    let m_ = cube(l - 0.105_561_345_8 * a - 0.063_854_172_8 * b);
    let s_ = cube(l - 0.089_484_177_5 * a - 1.291_485_548_0 * b);
    let linear = [
        4.076_741_662_1 * l_ - 3.307_711_591_3 * m_ + 0.230_969_929_2 * s_,
        -1.268_438_004_6 * l_ + 2.609_757_401_1 * m_ - 0.341_319_396_5 * s_,
        -0.004_196_086_3 * l_ - 0.703_418_614_7 * m_ + 1.707_614_701_0 * s_,
    ];
    linear.map(|value| value.clamp(0.0, 1.0) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_greater_number_is_never_darker() {
        let light = |number: f64| {
            let [r, g, b] = ramp(number).map(f64::from);
            0.2126 * r + 0.7152 * g + 0.0722 * b
        };
        for step in 0..100 {
            let number = f64::from(step) / 100.0;
            assert!(light(number + 0.01) > light(number), "{number}");
        }
        assert_eq!(ramp(f64::NAN), ramp(-1.0));
    }
}
