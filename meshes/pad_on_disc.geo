// A pad on a disc: an annular sector on a larger one, of which the rest of the disc is left out. Structured hexahedra.
//
// Lengths in mm, angles in degrees; the disc turns about z, the pad's middle lies on x, z up from the contact.
// Physical groups: every name starts with the body it belongs to, punch_ (the pad) or strip_ (the disc).

DefineConstant[
  inner_radius = 60,      // of the pad
  outer_radius = 100,
  angle = 60,             // of the pad, below 120
  pad_height = 12,
  plate_height = 0,       // of a backing plate on the pad, a region of its own
  disc_height = 12,
  margin = 20,            // by which the disc is wider on each side, below inner_radius
  margin_angle = 20,      // by which it goes on beyond the pad's ends
  across = 4,             // elements over the pad's width
  along = 6,              // elements over the pad's length
  margin_elements = 2,    // over each margin
  pad_layers = 2,         // elements over the height
  plate_layers = 1,
  disc_layers = 2,
  growth = 1,             // of an element's height over that of its neighbour towards the contact
  edge_grading = 1,       // of an element's width in the pad's middle over that at its sides
  margin_growth = 1,      // of an element's width over that of its neighbour towards the pad, in the disc's margins
  diffusion_area = 0      // diffusivity over the angular speed of a strip that turns, mm²/rad; 0: not known
];

If(diffusion_area < 0)
  Error("diffusion_area must not be negative");
EndIf
If(inner_radius <= 0 || outer_radius <= inner_radius || pad_height <= 0 || disc_height <= 0)
  Error("expected 0 < inner_radius < outer_radius, and positive heights");
EndIf
If(plate_height < 0 || plate_layers < 1)
  Error("plate_height must not be negative, plate_layers at least 1");
EndIf
If(angle <= 0 || angle >= 120 || margin_angle < 0 || margin_angle >= 120)
  Error("angle must lie between 0 and 120, margin_angle between 0 and 120");
EndIf
If(margin < 0 || margin >= inner_radius)
  Error("margin must lie between 0 and inner_radius");
EndIf
If(across < 1 || along < 1 || margin_elements < 1 || pad_layers < 1 || disc_layers < 1)
  Error("across, along, margin_elements, pad_layers and disc_layers must be at least 1");
EndIf
If(growth <= 0 || edge_grading <= 0 || margin_growth <= 0)
  Error("growth, edge_grading and margin_growth must be positive");
EndIf

// At the strip's surface elements are at most as high as the layer that heats up while it passes.
layer = Sqrt(diffusion_area * angle * Pi / 180);
whole = 0;
For i In {0 : disc_layers - 1}
  whole += growth^i;
EndFor
top_growth = growth;
If(layer > 0 && disc_height / whole > layer)
  top_growth = (growth > 1.5) ? growth : 1.5;
  top_count = Ceil(Log(1 + (top_growth - 1) * disc_height / layer) / Log(top_growth));
  disc_layers = (top_count > disc_layers) ? top_count : disc_layers;
EndIf
growths[] = {growth, top_growth};

// How far the circles of the margins lie from the pad.
beside[] = {0};
For k In {1 : margin_elements}
  If(margin_growth == 1)
    beside[] += margin * k / margin_elements;
  Else
    beside[] += margin * (margin_growth^k - 1) / (margin_growth^margin_elements - 1);
  EndIf
EndFor

For body In {0 : 1}
  // Radii and angles of the grid, and the elements between them.
  x[] = {}; y[] = {}; nx[] = {}; ny[] = {};
  // In the margins each element has lines of its own: those of order 2 then follow their circles.
  If(body == 1 && margin > 0)
    For k In {0 : margin_elements - 1}
      x[] += {inner_radius - beside[margin_elements - k]}; nx[] += 1;
    EndFor
  EndIf
  x[] += {inner_radius, outer_radius}; nx[] += across;
  If(body == 1 && margin > 0)
    For k In {1 : margin_elements}
      x[] += {outer_radius + beside[k]}; nx[] += 1;
    EndFor
  EndIf
  If(body == 1 && margin_angle > 0)
    y[] += {-angle / 2 - margin_angle}; ny[] += margin_elements;
  EndIf
  y[] += {-angle / 2, angle / 2}; ny[] += along;
  If(body == 1 && margin_angle > 0)
    y[] += {angle / 2 + margin_angle}; ny[] += margin_elements;
  EndIf
  // Levels of the grid, and the elements between them.
  z[] = {0, (body == 0) ? pad_height : -disc_height}; nz[] = {(body == 0) ? pad_layers : disc_layers};
  If(body == 0 && plate_height > 0)
    z[] += {pad_height + plate_height}; nz[] += {plate_layers};
  EndIf
  mx = #x[]; my = #y[]; mz = #z[]; o[] = {};

  // Points, lines along the radius, the circumference and z, faces and volumes by their place in the grid.
  p[] = {}; lx[] = {}; ly[] = {}; lz[] = {}; fx[] = {}; fy[] = {}; fz[] = {}; volumes~{body}[] = {};
  For k In {0 : mz - 1}
    n = newp; Point(n) = {0, 0, z[k]};
    o[] += n;
    For j In {0 : my - 1}
      For i In {0 : mx - 1}
        n = newp; Point(n) = {x[i] * Cos(y[j] * Pi / 180), x[i] * Sin(y[j] * Pi / 180), z[k]};
        p[] += n;
      EndFor
    EndFor
  EndFor
  For k In {0 : mz - 1}
    For j In {0 : my - 1}
      For i In {0 : mx - 2}
        l = newl; Line(l) = {p[i + mx * (j + my * k)], p[i + 1 + mx * (j + my * k)]};
        If(x[i] == inner_radius && edge_grading != 1)
          Transfinite Curve{l} = nx[i] + 1 Using Bump 1 / edge_grading;
        Else
          Transfinite Curve{l} = nx[i] + 1;
        EndIf
        lx[] += l;
      EndFor
    EndFor
    For j In {0 : my - 2}
      For i In {0 : mx - 1}
        l = newl;
        Circle(l) = {p[i + mx * (j + my * k)], o[k], p[i + mx * (j + 1 + my * k)]};
        Transfinite Curve{l} = ny[j] + 1;
        ly[] += l;
      EndFor
    EndFor
  EndFor
  For k In {0 : mz - 2}
    For j In {0 : my - 1}
      For i In {0 : mx - 1}
        l = newl; Line(l) = {p[i + mx * (j + my * k)], p[i + mx * (j + my * (k + 1))]};
        Transfinite Curve{l} = nz[k] + 1 Using Progression (k == 0) ? growths[body] : 1;
        lz[] += l;
      EndFor
    EndFor
  EndFor
  For k In {0 : mz - 1}
    For j In {0 : my - 2}
      For i In {0 : mx - 2}
        a = lx[i + (mx - 1) * (j + my * k)]; b = ly[i + 1 + mx * (j + (my - 1) * k)];
        c = lx[i + (mx - 1) * (j + 1 + my * k)]; d = ly[i + mx * (j + (my - 1) * k)];
        n = newll; Curve Loop(n) = {a, b, -c, -d};
        s = news; Plane Surface(s) = {n};
        fz[] += s;
      EndFor
    EndFor
  EndFor
  For k In {0 : mz - 2}
    For j In {0 : my - 1}
      For i In {0 : mx - 2}
        n = newll;
        Curve Loop(n) = {lx[i + (mx - 1) * (j + my * k)], lz[i + 1 + mx * (j + my * k)],
                         -lx[i + (mx - 1) * (j + my * (k + 1))], -lz[i + mx * (j + my * k)]};
        s = news; Plane Surface(s) = {n};
        fy[] += s;
      EndFor
    EndFor
    For j In {0 : my - 2}
      For i In {0 : mx - 1}
        n = newll;
        Curve Loop(n) = {ly[i + mx * (j + (my - 1) * k)], lz[i + mx * (j + 1 + my * k)],
                         -ly[i + mx * (j + (my - 1) * (k + 1))], -lz[i + mx * (j + my * k)]};
        s = news; Surface(s) = {n};
        fx[] += s;
      EndFor
    EndFor
  EndFor
  cells = (mx - 1) * (my - 1);
  For k In {0 : mz - 2}
    For j In {0 : my - 2}
      For i In {0 : mx - 2}
        n = newsl;
        Surface Loop(n) = {fz[i + (mx - 1) * j + cells * k], fz[i + (mx - 1) * j + cells * (k + 1)],
                           fy[i + (mx - 1) * (j + my * k)], fy[i + (mx - 1) * (j + 1 + my * k)],
                           fx[i + mx * (j + (my - 1) * k)], fx[i + 1 + mx * (j + (my - 1) * k)]};
        v = newv; Volume(v) = {n};
        volumes~{body}[] += v;
      EndFor
    EndFor
  EndFor
  Transfinite Surface{fx[], fy[], fz[]};
  Transfinite Volume{volumes~{body}[]};
  Recombine Surface{fx[], fy[], fz[]};
  contact~{body}[] = {fz[{0 : cells - 1}]};
  far~{body}[] = {fz[{cells * (mz - 1) : cells * mz - 1}]};
  sides~{body}[] = {}; ends~{body}[] = {};
  For k In {0 : mz - 2}
    For i In {0 : mx - 2}
      ends~{body}[] += {fy[i + (mx - 1) * my * k], fy[i + (mx - 1) * (my - 1 + my * k)]};
    EndFor
    For j In {0 : my - 2}
      sides~{body}[] += {fx[mx * (j + (my - 1) * k)], fx[mx - 1 + mx * (j + (my - 1) * k)]};
    EndFor
  EndFor
EndFor

Physical Volume("punch_body") = volumes_0[0];
If(plate_height > 0)
  Physical Volume("punch_plate") = volumes_0[1];
EndIf
Physical Surface("punch_contact") = contact_0[];
Physical Surface("punch_far") = far_0[];
Physical Surface("punch_sides") = sides_0[];      // the inner and the outer one
Physical Surface("punch_ends") = ends_0[];        // across the sliding
Physical Volume("strip_body") = volumes_1[];
Physical Surface("strip_contact") = contact_1[];
Physical Surface("strip_far") = far_1[];
Physical Surface("strip_sides") = sides_1[];
Physical Surface("strip_ends") = ends_1[];
