//! The images that a model is trained on, handed over by whoever can read them.

use datasets::Picture;

/// Why an image cannot be had.
pub type AlbumError = Box<dyn std::error::Error + Send + Sync>;

/// Images by number; asked for again and again, from several threads.
pub trait Album: Sync {
    /// The image of a person.
    ///
    /// # Errors
    ///
    /// Whatever keeps it from being read.
    fn person(&self, person: usize) -> Result<Picture, AlbumError>;

    /// Number of images without people.
    fn n_backgrounds(&self) -> usize;

    /// An image without people.
    ///
    /// # Errors
    ///
    /// Whatever keeps it from being read.
    fn background(&self, image: usize) -> Result<Picture, AlbumError>;
}
