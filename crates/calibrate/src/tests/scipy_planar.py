# planar 2R arm: theta1, theta2 offsets, l1, l2; 10 poses; one outlier
import numpy as np
from scipy.optimize import least_squares
q=np.array([[0.1*i-0.4, 0.15*i+0.2] for i in range(10)])
def fk(p,q):
    t1=p[0]+q[:,0]; t12=t1+p[1]+q[:,1]
    return np.stack([p[2]*np.cos(t1)+p[3]*np.cos(t12), p[2]*np.sin(t1)+p[3]*np.sin(t12)],1)
nom=np.array([0.0,0.0,0.4,0.3])
truth=np.array([0.02,-0.03,0.404,0.297])
y=fk(truth,q)+3e-4*np.array([[np.sin(7.0*i+1.0),np.cos(5.0*i+2.0)] for i in range(10)])
y[6]+= [0.03,-0.02]
s=3e-4
ps=np.array([0.03,0.03,0.005,0.005])
lo=np.array([-0.05,-0.05,0.395,0.295]); hi=np.array([0.05,0.05,0.4025,0.305])
c=1.50114108*1.345/1.34499751
def f(x,robust):
    p=nom+ps*x
    e=(y-fk(p,q))/s
    u=np.linalg.norm(e,axis=1)
    if robust:
        rho=np.where(u<=c,0.5*u*u,c*u-0.5*c*c)
        e=e*(np.sqrt(2*rho)/u)[:,None]
    return np.concatenate([e.ravel(),x])
import scipy; print(scipy.__version__)
for robust in (False,True):
    for bounds in (False,True):
        b=((lo-nom)/ps,(hi-nom)/ps) if bounds else (-np.inf,np.inf)
        r=least_squares(f,np.zeros(4),args=(robust,),bounds=b,xtol=1e-15,ftol=1e-15,gtol=1e-13,method='trf',max_nfev=10000, jac='3-point')
        print(robust,bounds,repr(list(nom+ps*r.x)),r.cost,r.nfev,r.message)
