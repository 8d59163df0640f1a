//! The part of the wire format of protocol buffers that an ONNX file needs: fields with numbers, texts, bytes and messages.

/// A message being written in the wire format of protocol buffers. It is used for the parts of files that [`Network`](crate::onnx::Network)
/// does not write.
#[must_use]
#[derive(Debug, Default, Clone)]
pub struct Message(Vec<u8>);

/// Wire types.
const VARINT: u64 = 0;
const BYTES: u64 = 2;

impl Message {
    /// Adds a field with an integer.
    pub fn number(mut self, field: u64, value: i64) -> Self {
        self.key(field, VARINT);
        self.varint(value as u64);
        self
    }

    /// Adds a field with bytes.
    pub fn bytes(mut self, field: u64, value: &[u8]) -> Self {
        self.key(field, BYTES);
        self.varint(value.len() as u64);
        self.0.extend(value);
        self
    }

    /// Adds a field with text.
    pub fn text(self, field: u64, value: &str) -> Self {
        self.bytes(field, value.as_bytes())
    }

    /// Adds a field with another message.
    pub fn message(self, field: u64, value: &Self) -> Self {
        self.bytes(field, &value.0)
    }

    /// Adds one field for every item.
    pub fn each<T>(
        self,
        items: impl IntoIterator<Item = T>,
        put: impl Fn(Self, T) -> Self,
    ) -> Self {
        items.into_iter().fold(self, put)
    }

    /// The bytes of the message.
    pub fn finish(self) -> Vec<u8> {
        self.0
    }

    fn key(&mut self, field: u64, wire: u64) {
        self.varint(field << 3 | wire);
    }

    fn varint(&mut self, mut value: u64) {
        while value >= 0x80 {
            self.0.push(value as u8 | 0x80);
            value >>= 7;
        }
        self.0.push(value as u8);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_texts_are_encoded_as_the_format_documents() {
        assert_eq!(
            Message::default().number(1, 150).finish(),
            [0x08, 0x96, 0x01]
        );
        let testing = [0x12, 0x07, 0x74, 0x65, 0x73, 0x74, 0x69, 0x6e, 0x67];
        assert_eq!(Message::default().text(2, "testing").finish(), testing);
        let inner = Message::default().number(1, 150);
        let outer = Message::default().message(3, &inner).finish();
        assert_eq!(outer, [0x1a, 0x03, 0x08, 0x96, 0x01]);
    }

    #[test]
    fn negative_numbers_take_ten_bytes() {
        let bytes = Message::default().number(1, -1).finish();
        assert_eq!(
            bytes[1..],
            [0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 1]
        );
    }
}
