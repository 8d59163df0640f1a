//! Access to the training images, implemented by the caller.

use crate::datasets::Picture;

/// Why an image cannot be read.
pub type AlbumError = Box<dyn std::error::Error + Send + Sync>;

/// Images by number; requested repeatedly, from several threads.
pub trait Album: Sync {
    /// The image of a person.
    ///
    /// # Errors
    ///
    /// Whatever keeps it from being read.
    fn person(&self, person: usize) -> Result<Picture, AlbumError>;

    /// Number of background images, which show no people.
    fn n_backgrounds(&self) -> usize;

    /// A background image.
    ///
    /// # Errors
    ///
    /// Whatever keeps it from being read.
    fn background(&self, image: usize) -> Result<Picture, AlbumError>;
}
