//! The rendering method that a scene selects, with its settings; the scene knows nothing about either.

use std::any::Any;
use std::fmt::Debug;
use std::sync::Arc;

/// The settings of a method.
pub trait MethodSettings: Any + Debug + Send + Sync {
    /// The method's name in the scene document.
    fn name(&self) -> &'static str;

    /// Whether both are equal settings of the same method.
    fn equals(&self, other: &dyn MethodSettings) -> bool;
}

/// A method together with its settings. Cheap to clone.
#[derive(Clone, Debug)]
pub struct MethodChoice(Arc<dyn MethodSettings>);

impl MethodChoice {
    /// The method whose settings these are.
    #[must_use]
    pub fn new(settings: impl MethodSettings) -> Self {
        Self(Arc::new(settings))
    }

    /// The method's name in the scene document.
    #[must_use]
    pub fn name(&self) -> &'static str {
        self.0.name()
    }

    /// The settings, if they are of this type.
    #[must_use]
    pub fn settings<S: MethodSettings>(&self) -> Option<&S> {
        let settings: &dyn Any = &*self.0;
        settings.downcast_ref()
    }
}

impl PartialEq for MethodChoice {
    fn eq(&self, other: &Self) -> bool {
        self.0.equals(&*other.0)
    }
}
