#ifndef TEST_KINEMATICS_H
#define TEST_KINEMATICS_H
typedef struct {
    double x, y, z;
} PmCartesian;
typedef struct EmcPose {
    PmCartesian tran;
    double a, b, c, u, v, w;
} EmcPose;
typedef enum { KINEMATICS_IDENTITY = 1, KINEMATICS_FORWARD_ONLY, KINEMATICS_INVERSE_ONLY, KINEMATICS_BOTH } KINEMATICS_TYPE;
typedef unsigned long int KINEMATICS_FORWARD_FLAGS;
typedef unsigned long int KINEMATICS_INVERSE_FLAGS;
extern int kinematicsForward(const double *joint, struct EmcPose *world, const KINEMATICS_FORWARD_FLAGS *fflags,
                             KINEMATICS_INVERSE_FLAGS *iflags);
extern int kinematicsInverse(const struct EmcPose *world, double *joint, const KINEMATICS_INVERSE_FLAGS *iflags,
                             KINEMATICS_FORWARD_FLAGS *fflags);
extern KINEMATICS_TYPE kinematicsType(void);
extern int kinematicsSwitchable(void);
extern int kinematicsSwitch(int type);
#define KINS_NOT_SWITCHABLE                        \
    int kinematicsSwitchable(void) { return 0; }   \
    int kinematicsSwitch(int type) {               \
        (void)type;                                \
        return 0;                                  \
    }                                              \
    EXPORT_SYMBOL(kinematicsSwitchable);           \
    EXPORT_SYMBOL(kinematicsSwitch);
#endif
