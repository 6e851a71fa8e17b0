//! Objects and arrays in memory of a C program.

use crate::status::HalflightStatus;
use core::ffi::c_void;
use halflight_core::memory::{ALIGNMENT, Arena, Footprint};

/// Bytes of an object of type `T` beside its `structures`, with what an address without alignment costs.
pub(crate) fn bytes_of<T>(structures: Footprint) -> usize {
    structures.bytes().saturating_add(size_of::<T>().next_multiple_of(ALIGNMENT) + ALIGNMENT)
}

/// Makes an object at the start of `bytes` bytes at `memory`, in an arena over the others, and stores its
/// address in `object`.
///
/// # Safety
/// `memory` is null or has `bytes` bytes that live and belong to the object as long as it is used; `object`
/// is null or can be written.
pub(crate) unsafe fn place<T>(
    (memory, bytes): (*mut c_void, usize),
    object: *mut *mut T,
    make: impl FnOnce(&mut Arena<'static>) -> Result<T, HalflightStatus>,
) -> Result<(), HalflightStatus> {
    if memory.is_null() || object.is_null() {
        return Err(HalflightStatus::Argument);
    }
    let memory = memory.cast::<u8>();
    let before = memory.align_offset(ALIGNMENT);
    let of_object = size_of::<T>().next_multiple_of(ALIGNMENT);
    let used = before.checked_add(of_object).filter(|&used| used <= bytes);
    let Some(used) = used else { return Err(HalflightStatus::Memory) };
    // SAFETY: `before` and `used` are within the `bytes` bytes of the caller.
    let (at, rest) = unsafe { (memory.add(before).cast::<T>(), memory.add(used)) };
    // SAFETY: the bytes belong to the object, and those of `at` and `rest` do not overlap. Memory of another
    // language has some value in each byte.
    let rest = unsafe { core::slice::from_raw_parts_mut(rest, bytes - used) };
    let made = make(&mut Arena::new(rest))?;
    // SAFETY: `at` is aligned to 64 bytes and has room for `T`, and `object` can be written.
    unsafe {
        at.write(made);
        object.write(at);
    }
    Ok(())
}

/// The object at `pointer`.
///
/// # Safety
/// `pointer` is null or that of a live object which no one else writes.
pub(crate) unsafe fn shared<'a, T>(pointer: *const T) -> Result<&'a T, HalflightStatus> {
    // SAFETY: by the caller.
    unsafe { pointer.as_ref() }.ok_or(HalflightStatus::Argument)
}

/// The object at `pointer`, to be changed.
///
/// # Safety
/// `pointer` is null or that of a live object which no one else uses.
pub(crate) unsafe fn unique<'a, T>(pointer: *mut T) -> Result<&'a mut T, HalflightStatus> {
    // SAFETY: by the caller.
    unsafe { pointer.as_mut() }.ok_or(HalflightStatus::Argument)
}

/// The array of `count` elements at `pointer`, which may be null where it is empty.
///
/// # Safety
/// `pointer` is null or has `count` elements that no one writes during the call.
pub(crate) unsafe fn array<'a, T>(pointer: *const T, count: usize) -> Result<&'a [T], HalflightStatus> {
    match (pointer.is_null(), count) {
        (_, 0) => Ok(&[]),
        (true, _) => Err(HalflightStatus::Argument),
        _ if !pointer.is_aligned() => Err(HalflightStatus::Argument),
        // SAFETY: by the caller, and aligned.
        _ => Ok(unsafe { core::slice::from_raw_parts(pointer, count) }),
    }
}

/// As [`array`], to be written.
///
/// # Safety
/// `pointer` is null or has `count` elements that no one else uses during the call.
pub(crate) unsafe fn array_mut<'a, T>(pointer: *mut T, count: usize) -> Result<&'a mut [T], HalflightStatus> {
    match (pointer.is_null(), count) {
        (_, 0) => Ok(&mut []),
        (true, _) => Err(HalflightStatus::Argument),
        _ if !pointer.is_aligned() => Err(HalflightStatus::Argument),
        // SAFETY: by the caller, and aligned.
        _ => Ok(unsafe { core::slice::from_raw_parts_mut(pointer, count) }),
    }
}

/// Elements of an array with a stride.
#[derive(Clone, Copy)]
pub(crate) struct Strided<T> {
    first: *const u8,
    count: usize,
    stride: usize,
    of: core::marker::PhantomData<T>,
}

impl<T: Copy> Strided<T> {
    /// The `count` elements from `first` on, `stride` bytes apart; 0: one after the other.
    pub(crate) fn new<U>(first: *const U, count: usize, stride: usize) -> Result<Self, HalflightStatus> {
        let stride = if stride == 0 { size_of::<T>() } else { stride };
        if first.is_null() && count > 0 || stride < size_of::<T>() {
            return Err(HalflightStatus::Argument);
        }
        Ok(Self { first: first.cast(), count, stride, of: core::marker::PhantomData })
    }

    /// Copies the elements to `to`, as many as both have.
    ///
    /// # Safety
    /// All elements can be read, and any bits are a `T`.
    pub(crate) unsafe fn copy_to(&self, to: &mut [T]) {
        for (index, to) in to.iter_mut().take(self.count).enumerate() {
            // SAFETY: by the caller: `index` is below the number of elements.
            *to = unsafe { self.get(index) };
        }
    }

    /// Element `index`.
    ///
    /// # Safety
    /// The element exists, and any bits are a `T`.
    pub(crate) unsafe fn get(&self, index: usize) -> T {
        // SAFETY: by the caller.
        unsafe { self.first.add(index * self.stride).cast::<T>().read_unaligned() }
    }
}
