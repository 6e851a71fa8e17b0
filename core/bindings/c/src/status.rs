//! Status of a call.

use core::ffi::{CStr, c_char};
use halflight_core::RenderError;
use halflight_core::memory::OutOfMemory;

/// Outcome of a call.
#[derive(Clone, Copy, PartialEq, Eq)]
#[repr(C)]
pub enum HalflightStatus {
    /// The call has done its work.
    Ok = 0,
    /// A pointer that must not be null is null, or a stride is smaller than an element.
    Argument = 1,
    /// The memory is smaller than the function of that name with `_memory` says.
    Memory = 2,
    /// A triangle refers to a vertex or a material that does not exist.
    Triangle = 3,
    /// A material has a surface that does not exist, or refers to a texture that does not.
    Material = 4,
    /// A texture has no texel, or texels that are not aligned.
    Texture = 5,
    /// A light has a kind that does not exist, or the environment a texture that does not.
    Light = 6,
    /// A picture has no pixel or more than 2^28, or there is no point or more than 2^30.
    Size = 7,
    /// A setting or a field of view has a value that it cannot have, or a count exceeds what there is.
    Setting = 8,
}

impl HalflightStatus {
    /// All, in the order of their numbers.
    const ALL: [Self; 9] = [
        Self::Ok,
        Self::Argument,
        Self::Memory,
        Self::Triangle,
        Self::Material,
        Self::Texture,
        Self::Light,
        Self::Size,
        Self::Setting,
    ];

    fn text(self) -> &'static CStr {
        match self {
            Self::Ok => c"done",
            Self::Argument => c"a pointer is null, or a stride is smaller than its element",
            Self::Memory => {
                c"there is less memory than the call needs; ask the function that ends in _memory"
            }
            Self::Triangle => c"a triangle refers to a vertex or a material that does not exist",
            Self::Material => c"a material has a surface or a texture that does not exist",
            Self::Texture => c"a texture has no texel, or texels that are not aligned to their type",
            Self::Light => c"a light has a kind that does not exist, or the environment such a texture",
            Self::Size => c"a picture has 1 to 2^28 pixels, and there are 1 to 2^30 points",
            Self::Setting => {
                c"a setting or a field of view has a value that it cannot have, or a count is too large"
            }
        }
    }
}

impl From<RenderError> for HalflightStatus {
    fn from(error: RenderError) -> Self {
        match error {
            RenderError::Memory(_) => Self::Memory,
            RenderError::Triangle(_) => Self::Triangle,
            RenderError::Size | RenderError::Points => Self::Size,
            _ => Self::Setting,
        }
    }
}

impl From<OutOfMemory> for HalflightStatus {
    fn from(_: OutOfMemory) -> Self {
        Self::Memory
    }
}

/// Status of a result.
pub(crate) fn of(result: Result<(), HalflightStatus>) -> HalflightStatus {
    result.err().unwrap_or(HalflightStatus::Ok)
}

/// A sentence about a `HalflightStatus`, which lives as long as the program.
#[unsafe(no_mangle)]
pub extern "C" fn halflight_status_text(status: u32) -> *const c_char {
    let known = HalflightStatus::ALL.get(status as usize);
    known.map_or(c"an unknown status", |status| status.text()).as_ptr()
}
