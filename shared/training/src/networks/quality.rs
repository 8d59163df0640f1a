//! The networks that predict the error of every part in a single view (the paper's section 4.3): samples and training.
//!
//! * [`Sample`](sample::Sample): a person in a picture, values from the search for the pose (the evidence), and the errors of the parts.
//! * [`QualityTask`](task::QualityTask): the training: passes over the samples until the result on the validation samples stops improving.
//! * [`Kind`](network::Kind): the networks, including the paper's VGG-16, whose weights [`vgg`] reads.

pub mod judge;
pub mod network;
pub mod sample;
pub mod settings;
pub mod store;
pub mod task;
pub mod vary;
pub mod vgg;
