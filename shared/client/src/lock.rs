//! Locks that remain usable after the panic of a thread.

use std::sync::{Mutex, PoisonError};

/// Locks a mutex, even if a thread panicked while it held the lock. The guarded data are consistent after every step.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
