//! Why a measurement cannot be predicted.

/// What cannot be predicted at a state, and why.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum MeasureError {
    /// No measurement of an image: its interior orientation does not exist.
    #[error("image `{image}`: an interior effect is outside its domain")]
    Image {
        /// Name.
        image: String,
    },
}
