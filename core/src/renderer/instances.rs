//! Instances of the renderers, compiled with this crate.
//!
//! A generic function that is never inlined is linked, not compiled, by a later crate if this crate has it
//! for the same types. The functions that trace the paths of a task are such: no program, test or example
//! compiles them again, and whatever it does not call is not linked. These pointers lead to all of them.

use super::{IrradianceRenderer, PointSettings, RenderError, Renderer, Settings, Until};
use crate::memory::Arena;
use crate::method::Loop;
use crate::scene::Scene;
use crate::transport::IrradiancePoint;

type NewPicture = fn(
    &'static Scene<'static>,
    &Settings,
    &mut Arena<'static>,
    &mut Loop<'static>,
) -> Result<Renderer<'static>, RenderError>;

type NewPoints = fn(
    &'static Scene<'static>,
    &[IrradiancePoint],
    &PointSettings,
    &mut Arena<'static>,
    &mut Loop<'static>,
) -> Result<IrradianceRenderer<'static>, RenderError>;

type Step<R> = fn(&mut R, &mut Loop<'static>, Until) -> Result<(), RenderError>;

/// [`Renderer::new`] on one thread.
pub static NEW_PICTURE: NewPicture = Renderer::new;

/// [`Renderer::step`] on one thread.
pub static STEP_PICTURE: Step<Renderer<'static>> = Renderer::step;

/// [`IrradianceRenderer::new`] on one thread.
pub static NEW_POINTS: NewPoints = IrradianceRenderer::new;

/// [`IrradianceRenderer::step`] on one thread.
pub static STEP_POINTS: Step<IrradianceRenderer<'static>> = IrradianceRenderer::step;
