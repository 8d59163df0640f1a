//! Access to the training images, implemented by the caller.

use crate::datasets::Picture;

/// Reason why an image cannot be read.
pub type AlbumError = Box<dyn std::error::Error + Send + Sync>;

/// Access to images by number. The same image may be requested repeatedly and from several threads.
pub trait Album: Sync {
    /// Returns the image of a person.
    ///
    /// # Errors
    ///
    /// Fails if the image cannot be read.
    fn person(&self, person: usize) -> Result<Picture, AlbumError>;

    /// Number of background images, which show no people.
    fn n_backgrounds(&self) -> usize;

    /// Returns a background image.
    ///
    /// # Errors
    ///
    /// Fails if the image cannot be read.
    fn background(&self, image: usize) -> Result<Picture, AlbumError>;
}
