//! Orientation tags for image files, because encoders do not write them.

/// Returns a JPEG or PNG file with an orientation tag.
///
/// * `value`: the number of the orientation in EXIF; `6` requests a rotation by 90 degrees to the right.
///
/// # Panics
///
/// Panics if the file has neither format.
pub fn tagged(file: &[u8], value: u8) -> Vec<u8> {
    // A TIFF header with one entry: orientation (0x0112), one short.
    let exif = [
        &b"II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0"[..],
        &[value],
        &[0; 7],
    ]
    .concat();
    if file.starts_with(b"\xff\xd8") {
        let length = (2 + 6 + exif.len()) as u16;
        let segment = [b"\xff\xe1", &length.to_be_bytes()[..], b"Exif\0\0", &exif].concat();
        return [&file[..2], &segment, &file[2..]].concat();
    }
    assert!(file.starts_with(b"\x89PNG"), "neither JPEG nor PNG");
    // The tag is inserted after the signature and the chunk `IHDR`.
    let (head, rest) = file.split_at(8 + 12 + 13);
    let chunk = [b"eXIf", &exif[..]].concat();
    let mut crc = flate2::Crc::new();
    crc.update(&chunk);
    let length = exif.len() as u32;
    [
        head,
        &length.to_be_bytes(),
        &chunk,
        &crc.sum().to_be_bytes(),
        rest,
    ]
    .concat()
}
