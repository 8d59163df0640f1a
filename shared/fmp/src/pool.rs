//! Workspaces that are used again from frame to frame, and the threads that share them.

use std::sync::{Mutex, MutexGuard, PoisonError};

use crossbeam::queue::ArrayQueue;

/// Most workspaces that are kept: more callers at a time than any machine of ours has threads, and those beyond
/// only make theirs anew.
const MOST: usize = 256;

/// Workspaces of one kind: a solution takes one when it begins, and returns it at the end.
///
/// A queue without locks, so that threads that begin and end at one time do not wait for each other. First in,
/// first out: for workspaces of which there is one per caller, not for those that are taken many times a frame and
/// should be warm in the cache.
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
    /// A free workspace, or a new one.
    pub(crate) fn take(&self) -> T {
        self.free.pop().unwrap_or_default()
    }

    /// Takes a workspace back.
    pub(crate) fn put_back(&self, workspace: T) {
        // Beyond the limit it is dropped.
        drop(self.free.push(workspace));
    }
}

/// Returns true if the caller runs inside a rayon pool, and so has asked for its threads to be used.
pub(crate) fn in_pool() -> bool {
    rayon::current_thread_index().is_some()
}

/// Locks a pool of workspaces; they hold nothing that a panic could have left half done.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_put_back_first_is_taken_first_and_then_new_ones_are_made() {
        let pool = Pool::<Vec<u8>>::default();
        pool.put_back(vec![7]);
        pool.put_back(vec![8]);
        assert_eq!(
            [pool.take(), pool.take(), pool.take()],
            [vec![7], vec![8], vec![]]
        );
    }

    #[test]
    fn beyond_the_limit_nothing_is_kept() {
        let pool = Pool::<u32>::default();
        for number in 1..=MOST as u32 + 1 {
            pool.put_back(number);
        }
        let kept = core::iter::from_fn(|| Some(pool.take()).filter(|&number| number > 0));
        assert_eq!(kept.count(), MOST);
    }
}
