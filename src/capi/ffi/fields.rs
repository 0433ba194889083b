//! Structs of the interface that repeat a struct of the library.

/// Converts a struct of the library to one of the interface: copies the named fields, cast to the interface's types; all others are 0. With
/// `<=>` also the other way: `over` replaces these fields of the library's own struct.
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
