!! What razy-modes is asked for, and who finds it.
module razy_study_modes_modes
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_input_input, only: input_t
   use razy_machine_linearised, only: contact_choices, contacts_closed, contacts_equilibrium
   use razy_machine_machine, only: machine_t
   use razy_scenes_case, only: new_structure
   use razy_scenes_rotor_bearings, only: check_tables
   use razy_scenes_rotor_reduction, only: is_reduced, reduce
   use razy_scenes_rotor_scene, only: rotor_scene_t
   use razy_study_modes_machine, only: find_machine_modes
   use razy_study_modes_reduction, only: compare_reductions
   use razy_study_modes_peaks, only: solve_response
   use razy_study_modes_response, only: new_response, response_t
   use razy_study_modes_result, only: modes_result_t
   use razy_study_modes_rotor, only: find_campbell, find_rotor_modes
   implicit none(type, external)
   private

   public :: find_modes, modes_task_t, new_modes

   !> What is asked for.
   type :: modes_task_t
      type(input_t) :: input
      character(:), allocatable :: title
      integer :: count = 0, contacts = 0
      !> One of the two is allocated.
      type(machine_t), allocatable :: machine
      type(rotor_scene_t), allocatable :: rotor
      type(response_t), allocatable :: response
   end type modes_task_t

contains

   !> Read and check what is asked for.
   subroutine new_modes(self, input, error)
      type(modes_task_t), intent(out) :: self
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      integer :: i

      call read_modes(self, input, error)
      i = findloc([(input%given("bearing", i, "clearance"), i=1, input%count("bearing"))], .true., dim=1)
      if (i > 0 .and. input%count("response") > 0 .and. .not. allocated(error)) then
         call input%complain(error, "bearing", i, "clearance", "left out with &response, which is that of linear bearings")
      end if
      if (allocated(error) .or. input%count("response") == 0) return
      allocate (self%response)
      call new_response(self%response, input, self%contacts, error)
   end subroutine new_modes

   subroutine read_modes(self, input, error)
      type(modes_task_t), intent(inout) :: self
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      logical :: reduced

      self%input = input
      call input%get("scene", 1, "title", self%title)
      call input%get("modes", 1, "count", self%count)
      self%contacts = findloc(contact_choices == input%choice("modes", 1, "contacts"), .true., dim=1)
      if (input%choice("scene", 1, "kind") /= "rotor") then
         allocate (self%machine)
         call new_structure(self%machine, input, error)
         return
      end if
      if (self%contacts == contacts_equilibrium) then
         call input%complain(error, "modes", 1, "contacts", "'open' or 'closed' in a rotor scene")
         return
      end if
      allocate (self%rotor)
      call self%rotor%build_model(input, .false., error)
      reduced = is_reduced(input)
      if (allocated(error)) return
      if (reduced .or. input%count("campbell") > 0 .or. any(.not. self%rotor%model%mass%diagonal() > 0.0_wp)) then
         call reduce(self%rotor%reduced, self%rotor%model, input, error)
      end if
      if (allocated(error) .or. input%count("campbell") == 0) return
      if (.not. input%number("campbell", 1, "last_rpm") > input%number("campbell", 1, "first_rpm")) then
         call input%complain(error, "campbell", 1, "last_rpm", "more than the first speed")
      end if
      if (.not. allocated(error)) call check_tables(self%rotor%model%rotor, input, "campbell", "first_rpm", error)
      if (.not. allocated(error)) call check_tables(self%rotor%model%rotor, input, "campbell", "last_rpm", error)
   end subroutine read_modes

   !> Find them. An error is one of the input, or an eigenproblem that was not solved.
   subroutine find_modes(self, content, error)
      type(modes_task_t), intent(in) :: self
      type(modes_result_t), intent(out) :: content
      type(error_t), allocatable, intent(out) :: error

      logical :: closed, reduced

      if (allocated(self%response)) then
         content%response = self%response
         call solve_response(content%response, error)
         if (allocated(error)) return
      end if
      if (allocated(self%machine)) then
         call find_machine_modes(content, self%machine, self%input, self%count, self%contacts, error)
         return
      end if
      closed = self%contacts == contacts_closed
      call find_rotor_modes(content, self%rotor, self%input, self%count, closed, error)
      reduced = is_reduced(self%input)
      if (.not. allocated(error) .and. reduced) call compare_reductions(content, self%rotor, self%input, error)
      if (.not. allocated(error) .and. self%input%count("campbell") > 0) then
         call find_campbell(content, self%rotor, self%input, self%count, closed, error)
      end if
   end subroutine find_modes

end module razy_study_modes_modes
