use std::sync::{Arc, Mutex, PoisonError};

/// A fact of a mesh between two that ask for it, one soon after the other: it is large, so the second takes it away.
#[derive(Debug)]
pub(crate) struct Known<T>(Arc<Mutex<Option<T>>>);

impl<T> Known<T> {
    pub fn new(fact: T) -> Self {
        Self(Arc::new(Mutex::new(Some(fact))))
    }

    /// The fact, once.
    pub fn take(&self) -> Option<T> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

// Not derived: the fact itself need not be one that can be cloned.
impl<T> Clone for Known<T> {
    fn clone(&self) -> Self {
        Self(self.0.clone())
    }
}

impl<T> Default for Known<T> {
    fn default() -> Self {
        Self(Arc::default())
    }
}
