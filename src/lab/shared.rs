//! What every request sees.

use super::state::Lab;
use std::sync::Arc;

/// What every request sees.
pub struct Shared {
    /// The laboratory.
    pub lab: Arc<Lab>,
    /// The port.
    pub port: u16,
    /// What a request of ours carries.
    pub token: String,
}
