//! Workspaces that are reused from frame to frame and shared by threads.

use std::sync::{Mutex, MutexGuard, PoisonError};

use crossbeam::queue::ArrayQueue;

/// Maximum number of workspaces that are kept. It exceeds the number of threads of our machines. If there are more callers, the only effect
/// is that new workspaces are created.
const MOST: usize = 256;

/// Workspaces of one kind: each solution takes a workspace when it begins, and returns it at the end.
///
/// The pool is a lock-free queue, so threads that begin and end at the same time do not wait for each other. It is first in, first out.
/// This suits workspaces that are taken once per call. It does not suit workspaces that are taken many times per frame and should still be
/// in the cache.
#[derive(Debug)]
pub(crate) struct Pool<T> {
    free: ArrayQueue<T>,
}

impl<T> Default for Pool<T> {
    fn default() -> Self {
        Self {
            free: ArrayQueue::new(MOST),
        }
    }
}

impl<T: Default> Pool<T> {
    /// Returns a free workspace, or a new one.
    pub(crate) fn take(&self) -> T {
        self.free.pop().unwrap_or_default()
    }

    /// Puts a workspace back.
    pub(crate) fn put_back(&self, workspace: T) {
        // A workspace beyond the limit is dropped.
        drop(self.free.push(workspace));
    }
}

/// Returns true if the caller runs inside a rayon pool, in which case the threads of the pool are used.
pub(crate) fn in_pool() -> bool {
    rayon::current_thread_index().is_some()
}

/// Locks a list of workspaces; a panic cannot leave them in an invalid state.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn returned_values_are_taken_in_order_and_then_new_ones_are_created() {
        let pool = Pool::<Vec<u8>>::default();
        pool.put_back(vec![7]);
        pool.put_back(vec![8]);
        assert_eq!(
            [pool.take(), pool.take(), pool.take()],
            [vec![7], vec![8], vec![]]
        );
    }

    #[test]
    fn values_beyond_the_limit_are_not_kept() {
        let pool = Pool::<u32>::default();
        for number in 1..=MOST as u32 + 1 {
            pool.put_back(number);
        }
        let kept = core::iter::from_fn(|| Some(pool.take()).filter(|&number| number > 0));
        assert_eq!(kept.count(), MOST);
    }
}
