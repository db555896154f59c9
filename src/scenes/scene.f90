!! A kind of scene: what its input may say, and the machine that an input becomes.
!!
!! A scene is made by `razy_scenes_factory`, asked for its schema, then given the checked input by `build`; the other
!! procedures belong to the machine that was built last. What only a scene can check is complained about as
!! `file: &group key = value: what is allowed`.
module razy_scenes_scene
   use razy_core_error, only: error_t
   use razy_input_input, only: input_t
   use razy_input_schema, only: group_spec_t
   use razy_machine_machine, only: machine_t, observable_t
   implicit none(type, external)
   private

   public :: scene_t

   type, abstract :: scene_t
   contains
      procedure(schema), deferred, nopass :: schema
      procedure(build), deferred :: build
      procedure(new_observable), deferred :: new_observable
      procedure(set_initial), deferred :: set_initial
   end type scene_t

   abstract interface
      !> All groups of an input of this kind.
      function schema() result(groups)
         import :: group_spec_t
         implicit none(type, external)
         type(group_spec_t), allocatable :: groups(:)
      end function schema

      !> The machine of an input: matrices, contacts, excitation; without observables and start.
      subroutine build(self, machine, input, error)
         import :: error_t, input_t, machine_t, scene_t
         implicit none(type, external)
         class(scene_t), intent(inout) :: self
         type(machine_t), intent(out) :: machine
         type(input_t), intent(in) :: input
         type(error_t), allocatable, intent(out) :: error
      end subroutine build

      !> The observable of `&record` number i, which is not `observable = 'state'`.
      subroutine new_observable(self, observable, machine, input, i, error)
         import :: error_t, input_t, machine_t, observable_t, scene_t
         implicit none(type, external)
         class(scene_t), intent(in) :: self
         type(observable_t), intent(out) :: observable
         type(machine_t), intent(in) :: machine
         type(input_t), intent(in) :: input
         integer, intent(in) :: i
         type(error_t), allocatable, intent(out) :: error
      end subroutine new_observable

      !> Displacement and velocity at the start as the groups `&initial` say; both are zero before.
      subroutine set_initial(self, machine, input, error)
         import :: error_t, input_t, machine_t, scene_t
         implicit none(type, external)
         class(scene_t), intent(in) :: self
         type(machine_t), intent(inout) :: machine
         type(input_t), intent(in) :: input
         type(error_t), allocatable, intent(out) :: error
      end subroutine set_initial
   end interface

end module razy_scenes_scene
