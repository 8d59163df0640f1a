//! Locks that outlive the panic of a thread.

use std::sync::{Mutex, PoisonError};

/// A lock that a thread has panicked with is as good as any here: what it guards is whole after every step.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
