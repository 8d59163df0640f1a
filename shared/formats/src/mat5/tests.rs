//! Tests that written values are read back.

use super::*;

#[test]
fn numbers_of_every_storage_are_read() {
    let cases: [(u32, &[u8], f64); 9] = [
        (MI_INT8, &[0xfe], -2.0),
        (MI_UINT8, &[0xfe], 254.0),
        (MI_INT16, &[0xfe, 0xff], -2.0),
        (MI_UINT16, &[0xfe, 0xff], 65534.0),
        (MI_INT32, &[0xfe, 0xff, 0xff, 0xff], -2.0),
        (MI_UINT32, &[0xfe, 0xff, 0xff, 0xff], 4294967294.0),
        (MI_SINGLE, &[0, 0, 0, 0x3f], 0.5),
        (MI_DOUBLE, &[0, 0, 0, 0, 0, 0, 0xe0, 0x3f], 0.5),
        (
            MI_INT64,
            &[0xfe, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff],
            -2.0,
        ),
    ];
    for (storage, bytes, expected) in cases {
        let sizes = vec![1, 1];
        let numbers = Numbers {
            sizes,
            storage,
            bytes,
        };
        assert_eq!(numbers.values(), [expected]);
    }
}

#[test]
fn an_array_of_three_dimensions_keeps_its_sizes_and_order() {
    let values: Vec<f64> = (0..24).map(|i| f64::from(i) - 0.5).collect();
    let array = testkit::mat::Mat::Numbers(vec![4, 2, 3], values.clone());
    for compressed in [false, true] {
        let file = testkit::mat::file("ptsAll", &array, compressed);
        let bytes = variables(&file).unwrap();
        let (name, value) = variable(&bytes[0]).unwrap();
        let Value::Numbers(numbers) = value else {
            unreachable!("numbers were written");
        };
        assert_eq!((name.as_str(), numbers.sizes()), ("ptsAll", &[4, 2, 3][..]));
        assert_eq!(numbers.values(), values);
    }
}
