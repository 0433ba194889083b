/* A cup of coffee with milk is spilled over a table with a groove, and falls over its edge: frazil's core library from C#, as in a game, at 60
 * frames per second. The surface, with the share of milk in each vertex, and the drops in the air are written as Unity takes them (Y up,
 * left-handed, clockwise) into arrays that are allocated once.
 *
 *   mcs -optimize -out:spill.exe Spill.cs && LD_LIBRARY_PATH=PREFIX/lib mono spill.exe
 */
using System;
using System.Diagnostics;
using System.Runtime.InteropServices;

/// <summary>The part of frazil.h that is used here, name by name.</summary>
static class Frazil {
    const string Library = "frazil_core"; /* libfrazil_core.so, frazil_core.dll */
    public const uint AbiVersion = 0x10009, LeftHanded = 2, LiquidWater = 0, Source = 0, Drain = 1, Open = 1;

    [StructLayout(LayoutKind.Sequential)]
    public struct View {
        public IntPtr Data;
        public UIntPtr Count, Stride;
    }

    [StructLayout(LayoutKind.Sequential)]
    public struct Params {
        public uint StructSize, Flags;
        public double Viscosity, Thinnest, ThinningTime, ThinningPower, GravityX, GravityY, GravityZ, Kept, LongestStep;
        public uint Pace, Border, Section, Reserved;
        public double FallsHeight, FallsInterval, FallsDrop;
        public uint FallsMost, Reserved2;
        public double Rest;
        public uint Friction, ThickeningScalar;
        public double ThickeningFrom, ThickeningTo, ThickeningTimes;
    }

    [StructLayout(LayoutKind.Sequential)]
    public struct Domain {
        public uint StructSize, Flags;
        public double Cell, OriginX, OriginZ;
        public uint CellsX, CellsZ;
        public double Low, High;
    }

    [StructLayout(LayoutKind.Sequential)]
    public struct Flow {
        public uint StructSize, Flags, Kind, Triangle;
        public double Share0, Share1, Share2, X, Y, Z, Radius, Rate, Capacity, PulseFrequency, PulseShare, Opening;
    }

    [StructLayout(LayoutKind.Sequential)]
    public struct Report {
        public uint StructSize, Steps;
        public double Seconds, Dropped, Deepest;
        public ulong Emptied, Filled, Slowed;
    }

    [StructLayout(LayoutKind.Sequential)]
    public struct Balance {
        public uint StructSize, Reserved;
        public double Inside, Poured, Sourced, Drained, Absorbed, Lost, Gained, Held;
        public long Error;
        public double Falling;
    }

    [StructLayout(LayoutKind.Sequential)]
    public struct Layout {
        public uint StructSize, Flags;
        public double Scale, LeastDepth, OpaqueDepth, FadeDepth;
    }

    [StructLayout(LayoutKind.Sequential)]
    public struct Size {
        public uint StructSize, Reserved;
        public ulong Vertices, Indices;
    }

    [StructLayout(LayoutKind.Sequential)]
    public struct Target {
        public uint StructSize, IndexBits;
        public View Positions, Normals, Depths, Opacities, Velocities, Layers, Columns, Indices, Scalar0, Scalar1, Scalar2, Scalar3;
    }

    [StructLayout(LayoutKind.Sequential)]
    public struct DropsTarget {
        public uint StructSize, IndexBits;
        public View Positions, Normals, Velocities, Drops, Indices;
    }

    [StructLayout(LayoutKind.Sequential, CharSet = CharSet.Ansi)]
    public struct Scalar {
        public uint StructSize, Law;
        public string Name;
        public double Range, HalfLife;
    }

    [DllImport(Library)] public static extern IntPtr frz_last_error();
    [DllImport(Library)] public static extern uint frz_pool_create(uint threads, out IntPtr pool);
    [DllImport(Library)] public static extern void frz_pool_destroy(IntPtr pool);
    [DllImport(Library)] public static extern uint frz_context_create(uint abi, IntPtr pool, out IntPtr context);
    [DllImport(Library)] public static extern void frz_context_destroy(IntPtr context);
    [DllImport(Library)] public static extern uint frz_shallow_params_init(ref Params values, UIntPtr size);
    [DllImport(Library)] public static extern uint frz_shallow_params_liquid(ref Params values, uint liquid);
    [DllImport(Library)]
    public static extern uint frz_shallow_create_heights(IntPtr context, ref Params values, ref Domain domain, View heights, out IntPtr shallow);
    [DllImport(Library)] public static extern void frz_shallow_destroy(IntPtr shallow);
    [DllImport(Library)] public static extern uint frz_shallow_set_flows(IntPtr shallow, [In] Flow[] flows, UIntPtr count);
    [DllImport(Library)]
    public static extern uint frz_shallow_step(IntPtr context, IntPtr shallow, double dt, double budget, ref Report report);
    [DllImport(Library)] public static extern uint frz_shallow_set_scalars(IntPtr shallow, [In] Scalar[] scalars, UIntPtr count);
    [DllImport(Library)] public static extern uint frz_shallow_set_sourced(IntPtr shallow, UIntPtr flow, View concentrations);
    [DllImport(Library)] public static extern uint frz_shallow_drops_bound(IntPtr shallow, ref Size size);
    [DllImport(Library)]
    public static extern uint frz_shallow_drops_mesh(IntPtr context, IntPtr shallow, ref Layout layout, ref DropsTarget target, ref Size size);
    [DllImport(Library)] public static extern uint frz_shallow_get_balance(IntPtr shallow, ref Balance balance);
    [DllImport(Library)] public static extern uint frz_shallow_layout_init(ref Layout layout, UIntPtr size);
    [DllImport(Library)] public static extern uint frz_shallow_surface_bound(IntPtr shallow, ref Size size);
    [DllImport(Library)]
    public static extern uint frz_shallow_surface(IntPtr context, IntPtr shallow, ref Layout layout, ref Target target, ref Size size);

    /// <summary>Turns a failure into an exception with the library's message.</summary>
    public static void Must(uint status) {
        if (status != 0) throw new InvalidOperationException(Marshal.PtrToStringAnsi(frz_last_error()));
    }

    public static uint SizeOf<T>() { return (uint)Marshal.SizeOf(typeof(T)); }
}

/// <summary>An array that stays where it is, for the library to read or write.</summary>
sealed class Pinned : IDisposable {
    GCHandle handle;
    readonly int count;

    public Pinned(Array array, int width) {
        handle = GCHandle.Alloc(array, GCHandleType.Pinned);
        count = array.Length / width;
    }

    public Frazil.View View {
        get { return new Frazil.View { Data = handle.AddrOfPinnedObject(), Count = (UIntPtr)(ulong)count, Stride = UIntPtr.Zero }; }
    }

    public void Dispose() { handle.Free(); }
}

static class Spill {
    const int Side = 120;
    const double Cell = 0.004; /* m */

    /// <summary>A table that falls off to its far side, with a groove across and a rim around it, and the floor beyond.</summary>
    static float[] Table() {
        var heights = new float[Side * Side];
        for (int z = 0; z < Side; ++z) {
            for (int x = 0; x < Side; ++x) {
                double groove = Math.Abs(z - 80) < 5 ? -0.004 : 0.0;
                bool rim = x == 0 || z == 0 || x == Side - 1;
                heights[z * Side + x] = (float)(z > Side - 10 ? -0.09 : rim ? 0.03 : groove - 0.03 * z * Cell);
            }
        }
        return heights;
    }

    static IntPtr Make(IntPtr context, float[] table) {
        var liquid = new Frazil.Params();
        Frazil.Must(Frazil.frz_shallow_params_init(ref liquid, (UIntPtr)Frazil.SizeOf<Frazil.Params>()));
        Frazil.Must(Frazil.frz_shallow_params_liquid(ref liquid, Frazil.LiquidWater)); /* coffee */
        liquid.Border = Frazil.Open;
        liquid.FallsMost = 2000;
        var domain = new Frazil.Domain {
            StructSize = Frazil.SizeOf<Frazil.Domain>(), Cell = Cell, OriginX = -0.5 * Side * Cell, OriginZ = -0.5 * Side * Cell,
            CellsX = Side, CellsZ = Side, Low = -0.1, High = 0.1
        };
        IntPtr shallow;
        using (var heights = new Pinned(table, 1)) {
            Frazil.Must(Frazil.frz_shallow_create_heights(context, ref liquid, ref domain, heights.View, out shallow));
        }
        var cup = new Frazil.Flow {
            StructSize = Frazil.SizeOf<Frazil.Flow>(), Kind = Frazil.Source, Z = -0.15, Radius = 0.012, Rate = 60e-6
        };
        var milk = new Frazil.Scalar { StructSize = Frazil.SizeOf<Frazil.Scalar>(), Name = "milk", Range = 1 };
        Frazil.Must(Frazil.frz_shallow_set_scalars(shallow, new[] { milk }, (UIntPtr)1));
        Frazil.Must(Frazil.frz_shallow_set_flows(shallow, new[] { cup }, (UIntPtr)1));
        using (var third = new Pinned(new[] { 0.3 }, 1)) Frazil.Must(Frazil.frz_shallow_set_sourced(shallow, UIntPtr.Zero, third.View));
        return shallow;
    }

    static int Main() {
        IntPtr pool, context;
        Frazil.Must(Frazil.frz_pool_create(0, out pool)); /* all work is done by this thread */
        Frazil.Must(Frazil.frz_context_create(Frazil.AbiVersion, pool, out context));
        Frazil.frz_pool_destroy(pool);
        IntPtr coffee = Make(context, Table());

        var bound = new Frazil.Size { StructSize = Frazil.SizeOf<Frazil.Size>() };
        Frazil.Must(Frazil.frz_shallow_surface_bound(coffee, ref bound));
        var positions = new float[3 * bound.Vertices];
        var normals = new float[3 * bound.Vertices];
        var opacities = new float[bound.Vertices];
        var milk = new float[bound.Vertices];
        var indices = new ushort[bound.Indices];
        Frazil.Must(Frazil.frz_shallow_drops_bound(coffee, ref bound));
        var dropPositions = new float[3 * bound.Vertices];
        var dropIndices = new uint[bound.Indices];
        var layout = new Frazil.Layout();
        Frazil.Must(Frazil.frz_shallow_layout_init(ref layout, (UIntPtr)Frazil.SizeOf<Frazil.Layout>()));
        layout.Flags = Frazil.LeftHanded;

        var report = new Frazil.Report { StructSize = Frazil.SizeOf<Frazil.Report>() };
        var balance = new Frazil.Balance { StructSize = Frazil.SizeOf<Frazil.Balance>() };
        var drawn = new Frazil.Size { StructSize = Frazil.SizeOf<Frazil.Size>() };
        var falling = drawn;
        ulong mostFalling = 0;
        double sum = 0, worst = 0;
        const int frames = 300;
        using (Pinned a = new Pinned(positions, 3), b = new Pinned(normals, 3), c = new Pinned(opacities, 1), d = new Pinned(indices, 1),
                      e = new Pinned(milk, 1), f = new Pinned(dropPositions, 3), g = new Pinned(dropIndices, 1)) {
            var target = new Frazil.Target {
                StructSize = Frazil.SizeOf<Frazil.Target>(), IndexBits = 16, Positions = a.View, Normals = b.View, Opacities = c.View,
                Indices = d.View, Scalar0 = e.View
            };
            var drops = new Frazil.DropsTarget {
                StructSize = Frazil.SizeOf<Frazil.DropsTarget>(), IndexBits = 32, Positions = f.View, Indices = g.View
            };
            for (int frame = 0; frame < frames; ++frame) {
                /* The cup holds 120 ml: it is empty after two seconds. */
                if (frame == 120) Frazil.Must(Frazil.frz_shallow_set_flows(coffee, null, UIntPtr.Zero));
                var watch = Stopwatch.StartNew();
                Frazil.Must(Frazil.frz_shallow_step(context, coffee, 1.0 / 60, 0.008, ref report));
                Frazil.Must(Frazil.frz_shallow_surface(context, coffee, ref layout, ref target, ref drawn));
                Frazil.Must(Frazil.frz_shallow_drops_mesh(context, coffee, ref layout, ref drops, ref falling));
                mostFalling = Math.Max(mostFalling, falling.Indices / 3);
                double ms = watch.Elapsed.TotalMilliseconds;
                sum += ms;
                worst = Math.Max(worst, ms);
                if (frame % 60 != 59) continue;
                Frazil.Must(Frazil.frz_shallow_get_balance(coffee, ref balance));
                Console.WriteLine("{0,3:0} s: {1,6:0.0} ml poured, {2,6:0.0} on table and floor, {3,6:0.0} in the air, {4,6:0.0} gone; {5} triangles",
                                  (frame + 1) / 60, balance.Sourced * 1e6, balance.Inside * 1e6, balance.Falling * 1e6, balance.Lost * 1e6,
                                  (drawn.Indices + falling.Indices) / 3);
            }
        }
        Console.WriteLine("ms a frame: {0:0.00} on average, {1:0.00} at worst", sum / frames, worst);
        Frazil.Must(Frazil.frz_shallow_get_balance(coffee, ref balance));
        Frazil.frz_shallow_destroy(coffee);
        Frazil.frz_context_destroy(context);
        /* Heights are integers: nothing is missing. All vertices have the milk of the cup. */
        bool isMixed = drawn.Vertices > 0 && Math.Abs(milk[0] - 0.3) < 1e-3 && Math.Abs(milk[drawn.Vertices - 1] - 0.3) < 1e-3;
        return balance.Error == 0 && isMixed && mostFalling > 0 && Math.Abs(balance.Sourced - 120e-6) < 1e-9 ? 0 : 1;
    }
}
