"""Claims shared by searches and checker: nonlinear programs in standard form, and claims about a workspace.

The modules import each other in this order: ``form``, ``standard_form`` and ``limb_separation`` for certificates;
``fixed_robot`` (a robot with fixed dimensions), ``claims``, ``posed_layout`` (a case as expressions of the pose) and
``tolerance`` (robots within the joint-centre tolerance) for workspaces.
"""
