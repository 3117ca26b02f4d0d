import sys, numpy as np
from fenwear import load_case, march
try:
    from fenwear import assemble as build
    F=lambda s: s.pair
except ImportError:
    from fenwear import System as build
    F=lambda s: s.facing
out={}
for n in (8,16,32,64):
    s=build(load_case("example1",["geometry.parameters.overlap=4","wear.strip.coefficient=1e-8","motion.positions=5",f"geometry.parameters.elements_along_contact={n}"]))
    for b in march(s,10,implicit=True): last=b
    st=F(s).strip
    out[f"x{n}"]=st.x[:,0]; out[f"w{n}"]=last.wear_strip[-1]; out[f"wt{n}"]=st.weights; out[f"p{n}"]=last.pressure[-1]; out[f"px{n}"]=F(s).x
np.savez(sys.argv[1],**out)
