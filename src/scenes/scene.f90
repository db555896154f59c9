!! A kind of scene: what its input may say, and the machine that an input becomes.
!!
!! A scene is made by `razy_scenes_factory`, asked for its schema, then given the checked input by `build`; the other
!! procedures belong to the machine that was built last. What only a scene can check is complained about as
!! `file: &group key = value: what is allowed`.
module razy_scenes_scene
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_core_text, only: string_t
   use razy_input_input, only: input_t
   use razy_input_schema, only: group_spec_t
   use razy_machine_frame, only: frame_t
   use razy_machine_machine, only: machine_t
   implicit none(type, external)
   private

   public :: beside_structure, coordinate_t, force_t, scene_t, says_same, site_t

   !> Groups that say what is done with a machine, where it starts, or what acts on it.
   character(*), parameter :: beside_structure(*) = [character(8) :: "motion", "record", "sweep", "tune", "starts", "duel", &
                                                                                              "initial", "load", "friction", "ring"]

   !> A coordinate, or the motion of a point, that an input names.
   type :: coordinate_t
      character(:), allocatable :: name
      !> Its motion is row·q, q being the coordinates of the machine; an angle if it `turns`.
      real(wp), allocatable :: row(:)
      logical :: turns = .false.
      !> Its number among the coordinates of the machine; 0 if it is none of them.
      integer :: number = 0
   end type coordinate_t

   !> A force on_displacement·q + on_velocity·q' (n each), N; a moment, N m, if it `turns`.
   type :: force_t
      real(wp), allocatable :: on_displacement(:), on_velocity(:)
      logical :: turns = .false.
   end type force_t

   !> Where a contact acts.
   type :: site_t
      !> Its direction: s = wᵀq; an angle if it `turns`.
      real(wp), allocatable :: w(:)
      logical :: turns = .false.
      !> Which sides of a stop there are: where s is small, where it is large.
      logical :: sides(2) = [.true., .false.]
      !> Constant part of s' beside that of a belt, m/s (rad/s).
      real(wp) :: drive = 0.0_wp
      !> Its rate in a run-up, m/s² (rad/s²).
      real(wp) :: drive_rate = 0.0_wp
      !> Of a ring and of friction on it.
      type(frame_t), allocatable :: frame
   end type site_t

   type, abstract :: scene_t
      !> The last machine without contacts and what acts on it, where the kind of scene keeps that.
      type(machine_t), allocatable :: structure
      !> What its structure was made of; not allocated where there is none to keep.
      real(wp), allocatable, private :: made_of(:)
   contains
      procedure :: renew
      procedure :: begin_structure
      procedure(new_structure), deferred :: new_structure
      procedure(schema), deferred, nopass :: schema
      procedure(build), deferred :: build
      procedure(find_coordinate), deferred :: find_coordinate
      procedure(find_site), deferred :: find_site
      procedure(find_force), deferred :: find_force
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

      !> What a scene keeps from machine to machine, as far as an input says the same.
      subroutine new_structure(self, input, error)
         import :: error_t, input_t, scene_t
         implicit none(type, external)
         class(scene_t), intent(inout) :: self
         type(input_t), intent(in) :: input
         type(error_t), allocatable, intent(out) :: error
      end subroutine new_structure

      !> What `key` of `group` number i names; in `initial` it has to be a coordinate of the machine itself.
      subroutine find_coordinate(self, coordinate, input, group, i, key, error)
         import :: coordinate_t, error_t, input_t, scene_t
         implicit none(type, external)
         class(scene_t), intent(in) :: self
         type(coordinate_t), intent(out) :: coordinate
         type(input_t), intent(in) :: input
         character(*), intent(in) :: group, key
         integer, intent(in) :: i
         type(error_t), allocatable, intent(out) :: error
      end subroutine find_coordinate

      !> The force of the spring, damper or bearing that `name`, given by `&record` number i, is; linear ones only.
      subroutine find_force(self, force, input, i, name, error)
         import :: error_t, force_t, input_t, scene_t
         implicit none(type, external)
         class(scene_t), intent(in) :: self
         type(force_t), intent(out) :: force
         type(input_t), intent(in) :: input
         integer, intent(in) :: i
         character(*), intent(in) :: name
         type(error_t), allocatable, intent(out) :: error
      end subroutine find_force

      !> Where number i of `group`, which is `stop`, `ring`, `spring` or `friction`, acts; an element of friction rubs on number
      !> `stop` of all &stop and, after them, &ring; 0: none.
      subroutine find_site(self, site, input, group, i, stop, error)
         import :: error_t, input_t, scene_t, site_t
         implicit none(type, external)
         class(scene_t), intent(in) :: self
         type(site_t), intent(out) :: site
         type(input_t), intent(in) :: input
         character(*), intent(in) :: group
         integer, intent(in) :: i, stop
         type(error_t), allocatable, intent(out) :: error
      end subroutine find_site
   end interface

contains

   !> Make the structure anew if the input says another one than before: the speed of &rotation and the groups left out are not
   !> of it.
   subroutine renew(self, input, left_out, error)
      class(scene_t), intent(inout) :: self
      type(input_t), intent(in) :: input
      character(*), intent(in) :: left_out(:)
      type(error_t), allocatable, intent(out) :: error

      if (says_same(self%made_of, input, left_out, within=.false.)) return
      call self%new_structure(input, error)
      if (allocated(error)) deallocate (self%made_of)
   end subroutine renew

   !> Whether an input says the same as `made_of` `within` these groups, or else in all others, but for the speed of &rotation;
   !> `made_of` is then what it says.
   logical function says_same(made_of, input, groups, within)
      real(wp), allocatable, intent(inout) :: made_of(:)
      type(input_t), intent(in) :: input
      character(*), intent(in) :: groups(:)
      logical, intent(in) :: within

      real(wp), allocatable :: numbers(:)

      numbers = input%numbers(groups, within, "rotation", "speed_rpm")
      says_same = allocated(made_of)
      if (says_same) says_same = size(numbers) == size(made_of)
      if (says_same) says_same = .not. any(abs(numbers - made_of) > 0.0_wp)
      call move_alloc(numbers, made_of)
   end function says_same

   !> A structure of coordinates with these names, which are angles if they turn, and masses, so far without springs.
   subroutine begin_structure(self, name, turns, mass, contacts, input)
      class(scene_t), intent(inout) :: self
      type(string_t), intent(in) :: name(:)
      logical, intent(in) :: turns(:)
      real(wp), intent(in) :: mass(:)
      integer, intent(in) :: contacts
      type(input_t), intent(in) :: input

      integer :: i

      self%structure = machine_t(coordinate=[character(64) ::(name(i)%text, i=1, size(name))], &
                                 unit=[character(16) :: merge("rad", "m  ", turns)], &
                                 rate_unit=[character(16) :: merge("rad/s", "m/s  ", turns)])
      associate (machine => self%structure, n => size(name))
         call input%get("scene", 1, "title", machine%title)
         allocate (machine%mass(n, n), machine%damping(n, n), machine%stiffness(n, n), machine%load(n), source=0.0_wp)
         allocate (machine%contact(contacts))
         do i = 1, n
            machine%mass(i, i) = mass(i)
         end do
      end associate
   end subroutine begin_structure

end module razy_scenes_scene
