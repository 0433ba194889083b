//! Macros for structs of the interface.

/// Implements [`Sized32`](super::views::Sized32) for a struct: `later` are the first fields of each later version of the header, `defaults`
/// the values of fields that a host does not set, by default 0.
///
/// The struct must be `repr(C)`, begin with `struct_size: u32`, and consist of numbers and pointers.
macro_rules! sized32 {
    ($host:ident) => {
        sized32!($host, []);
    };
    ($host:ident, [$($later:ident),*]) => {
        sized32!($host, [$($later),*], $crate::capi::ffi::views::Sized32::zeroed());
    };
    ($host:ident, [$($later:ident),*], $defaults:expr) => {
        const _: () = assert!(std::mem::offset_of!($host, struct_size) == 0);

        // SAFETY: it begins with its size, and zero bytes are valid numbers and pointers.
        unsafe impl $crate::capi::ffi::views::Sized32 for $host {
            const SIZES: &'static [usize] =
                &[$(std::mem::offset_of!($host, $later),)* size_of::<Self>()];
            const NAME: &'static str = stringify!($host);

            fn defaults() -> Self {
                $defaults
            }
        }
    };
}
pub(in crate::capi) use sized32;

/// Converts a struct of the library to one of the interface: copies the named fields, cast to the interface's types; all others are 0. With
/// `<=>` also converts back: `over` replaces these fields of the library's own struct.
macro_rules! fields_of {
    ($own:ident <=> $host:ident { $($field:ident),+ }) => {
        fields_of!($own => $host { $($field),+ });

        impl $host {
            fn over(&self, mut own: $own) -> $own {
                $(own.$field = self.$field as _;)+
                own
            }
        }
    };
    ($own:ty => $host:ty { $($field:ident),+ }) => {
        impl From<$own> for $host {
            fn from(own: $own) -> Self {
                Self { $($field: own.$field as _,)+ ..$crate::capi::ffi::views::Sized32::zeroed() }
            }
        }
    };
}
pub(in crate::capi) use fields_of;
