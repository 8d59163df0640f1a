//! Half precision (IEEE 754 binary16).

/// Bits of the nearest half-precision number, ties to even. Values that are too large become infinite.
pub(crate) fn bits_of(value: f32) -> u16 {
    let bits = value.to_bits();
    let sign = (bits >> 16 & 0x8000) as u16;
    let magnitude = bits & 0x7fff_ffff;
    if magnitude > 0x7f80_0000 {
        return sign | 0x7e00; // not a number
    }
    if magnitude >= 0x477f_f000 {
        return sign | 0x7c00; // 65520 and more
    }
    if magnitude < 0x3880_0000 {
        // Below the smallest normal number, the steps are 2^-24 wide.
        let steps = f32::from_bits(magnitude) * 16_777_216.0;
        return sign | steps.round_ties_even() as u16;
    }
    // The exponent bias is 15 instead of 127; 13 bits of the fraction are dropped.
    let kept = magnitude - 0x3800_0000;
    let is_odd = kept >> 13 & 1;
    sign | ((kept + 0xfff + is_odd) >> 13) as u16
}

/// The value of a half-precision number given by its bits.
pub fn value_of(bits: u16) -> f32 {
    let sign = u32::from(bits & 0x8000) << 16;
    let magnitude = u32::from(bits & 0x7fff) << 13;
    // The exponent bias is 15 instead of 127. The result is exact, even below the smallest normal number.
    let scale = f32::from_bits((127 + 112) << 23);
    let magnitude = match bits >> 10 & 31 {
        31 => magnitude | 0x7f80_0000,
        _ => (f32::from_bits(magnitude) * scale).to_bits(),
    };
    f32::from_bits(sign | magnitude)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_half_precision_number_keeps_its_bits() {
        for bits in 0..=u16::MAX {
            let value = value_of(bits);
            if !value.is_nan() {
                assert_eq!(bits_of(value), bits, "{value}");
            }
        }
        assert!(value_of(bits_of(f32::NAN)).is_nan());
    }

    #[test]
    fn numbers_are_rounded_to_the_nearest_and_ties_to_even() {
        for bits in (0..0x7bff_u16).step_by(7) {
            let [low, high] = [value_of(bits), value_of(bits + 1)];
            let middle = f32::midpoint(low, high);
            let even = bits + (bits & 1);
            assert_eq!(bits_of(middle), even, "{middle}");
            let quarter = f32::midpoint(low, middle);
            assert_eq!(bits_of(quarter), bits, "{quarter}");
            assert_eq!(bits_of(f32::midpoint(middle, high)), bits + 1);
        }
        assert_eq!(bits_of(65_519.0), 0x7bff);
        assert_eq!(bits_of(65_520.0), 0x7c00);
        assert_eq!(bits_of(-1e9), 0xfc00);
    }
}
