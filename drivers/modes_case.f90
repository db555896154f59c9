!! What razy-modes finds for an input: natural frequencies and shapes, and for rotors a Campbell diagram.
module modes_case
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use, intrinsic :: iso_fortran_env, only: int32
   use razy_core_error, only: error_t, raise
   use razy_core_input, only: input_t
   use razy_core_kinds, only: pi, wp
   use razy_core_text, only: lower
   use razy_dynamics_linearised, only: contact_choices, contacts_closed, contacts_equilibrium, linear_curved, &
                                       linear_no_equilibrium, linear_rigid, linearise
   use razy_dynamics_modes, only: damped_eigenvalues, energy_shares, hertz, modes_t, natural_modes
   use razy_io_modes_file, only: modes_content_t
   use razy_linalg_dense, only: product_of
   use razy_linalg_generalised, only: dense_modes, eigenpairs_t, keep_first, modes_found
   use razy_machine_machine, only: machine_t
   use razy_rotor_campbell, only: campbell_t, new_campbell
   use razy_rotor_model, only: rotor_model_t
   use razy_rotor_modes, only: rotor_shares => energy_shares, rotor_modes => natural_modes, strain_shares
   use razy_rotor_stability, only: limit_below, limit_failed, limit_found, limit_t, stability_limit
   use razy_rotor_whirl, only: new_whirl, whirl_found, whirl_problem_t
   use razy_scenes_rotor, only: rotor_scene_t
   use razy_scenes_rotor_reduction, only: is_reduced
   use razy_scenes_study, only: new_structure
   implicit none(type, external)
   private

   public :: find_modes, modes_task_t, new_modes

   !> Relative error of the stability limit.
   real(wp), parameter :: limit_tolerance = 1.0e-9_wp
   character(*), parameter :: motions(4) = [character(64) :: "axial", "torsion", "bending in xy", "bending in xz"]
   character(*), parameter :: strained(3) = [character(64) :: "shafts", "bearings", "meshes"]

   !> What is asked for.
   type :: modes_task_t
      type(input_t) :: input
      character(:), allocatable :: title
      integer :: count = 0, contacts = 0
      !> One of the two is allocated.
      type(machine_t), allocatable :: machine
      type(rotor_scene_t), allocatable :: rotor
   end type modes_task_t

contains

   !> Read and check what is asked for.
   subroutine new_modes(self, input, error)
      type(modes_task_t), intent(out) :: self
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      character(:), allocatable :: contacts, kind
      real(wp) :: first, last
      logical :: reduced

      self%input = input
      call input%get("scene", 1, "title", self%title)
      call input%get("modes", 1, "count", self%count)
      call input%get("modes", 1, "contacts", contacts)
      self%contacts = findloc(contact_choices == lower(contacts), .true., dim=1)
      call input%get("scene", 1, "kind", kind)
      if (lower(kind) /= "rotor") then
         allocate (self%machine)
         call new_structure(self%machine, input, error)
         return
      end if
      if (self%contacts == contacts_equilibrium) then
         call input%complain(error, "modes", 1, "contacts", "'open' or 'closed' in a rotor scene")
         return
      end if
      allocate (self%rotor)
      call self%rotor%build_model(input, error)
      reduced = is_reduced(input)
      if (.not. allocated(error) .and. (reduced .or. input%count("campbell") > 0)) call self%rotor%build_reduced(input, error)
      if (allocated(error) .or. input%count("campbell") == 0) return
      call input%get("campbell", 1, "first_rpm", first)
      call input%get("campbell", 1, "last_rpm", last)
      if (.not. last > first) call input%complain(error, "campbell", 1, "last_rpm", "more than the first speed")
   end subroutine new_modes

   !> Find them. An error is one of the input, or an eigenproblem that was not solved.
   subroutine find_modes(self, content, error)
      type(modes_task_t), intent(in) :: self
      type(modes_content_t), intent(out) :: content
      type(error_t), allocatable, intent(out) :: error

      if (allocated(self%machine)) then
         call find_machine_modes(self, content, error)
      else
         call find_rotor_modes(self, content, error)
         if (.not. allocated(error) .and. self%input%count("campbell") > 0) call find_campbell(self, content, error)
      end if
   end subroutine find_modes

   subroutine find_machine_modes(self, content, error)
      type(modes_task_t), intent(in) :: self
      type(modes_content_t), intent(inout) :: content
      type(error_t), allocatable, intent(out) :: error

      type(modes_t) :: modes
      real(wp), allocatable :: damping(:, :), share(:, :), stiffness(:, :)
      complex(wp), allocatable :: values(:)
      integer :: culprit, kept, status

      call linearise(self%machine, self%contacts, stiffness, damping, status, culprit)
      if (status == linear_no_equilibrium) then
         call self%input%complain(error, "modes", 1, "contacts", "'closed' or 'open', or constant loads that are in equilibrium")
      else if (status == linear_rigid) then
         call self%input%complain(error, "modes", 1, "contacts", "'open': the contact "//self%machine%contact(culprit)%name// &
                                  " is rigid")
      else if (status == linear_curved) then
         call self%input%complain(error, "modes", 1, "contacts", "'open': the contact "//self%machine%contact(culprit)%name// &
                                  " is not piecewise linear")
      end if
      if (allocated(error)) return
      call natural_modes(modes, self%machine%mass, stiffness, status)
      if (status == 0) call damped_eigenvalues(values, self%machine%mass, damping, stiffness, status)
      if (status /= 0) then
         call raise(error, "the eigenproblem could not be solved")
         return
      end if
      kept = min(self%count, size(modes%value))
      share = energy_shares(modes, self%machine%mass)
      content%coordinate = self%machine%coordinate
      content%part = content%coordinate
      content%natural = hertz(modes%value(:kept))
      content%shape = modes%shape(:, :kept)
      content%share = share(:, :kept)
      content%speed = [0.0_wp]
      content%frequency = reshape(content%natural, [kept, 1])
      values = by_imaginary_part(pack(values, values%im >= 0.0_wp))
      content%eigenvalue = parts_of(reshape(values, [size(values), 1]))
   end subroutine find_machine_modes

   pure function by_imaginary_part(values) result(sorted)
      complex(wp), intent(in) :: values(:)
      complex(wp), allocatable :: sorted(:)

      complex(wp) :: moved
      integer :: i, j

      sorted = values
      do i = 2, size(sorted)
         moved = sorted(i)
         j = i - 1
         do while (j >= 1)
            if (sorted(j)%im <= moved%im) exit
            sorted(j + 1) = sorted(j)
            j = j - 1
         end do
         sorted(j + 1) = moved
      end do
   end function by_imaginary_part

   !> (2, values, speeds).
   pure function parts_of(values) result(parts)
      complex(wp), intent(in) :: values(:, :)
      real(wp), allocatable :: parts(:, :, :)

      allocate (parts(2, size(values, 1), size(values, 2)))
      parts(1, :, :) = real(values, wp)
      parts(2, :, :) = aimag(values)
   end function parts_of

   !> Undamped modes at rest.
   subroutine find_rotor_modes(self, content, error)
      type(modes_task_t), intent(in) :: self
      type(modes_content_t), intent(inout) :: content
      type(error_t), allocatable, intent(out) :: error

      type(eigenpairs_t) :: pairs
      logical :: closed
      integer :: i, m

      closed = self%contacts == contacts_closed
      associate (model => self%rotor%model, reduced => self%rotor%reduced)
         if (is_reduced(self%input)) then
            if (closed) then
               pairs = dense_modes(reduced%closed_stiffness(), reduced%mass)
            else
               pairs = dense_modes(reduced%stiffness, reduced%mass)
            end if
            if (pairs%status == modes_found) then
               call keep_first(pairs, min(self%count, size(pairs%value)))
               pairs%vector = product_of(reduced%basis, pairs%vector)
            end if
         else
            pairs = rotor_modes(model, self%count, closed)
         end if
         if (pairs%status /= modes_found) then
            call raise(error, "the eigenproblem could not be solved")
            return
         end if
         m = size(pairs%value)
         content%coordinate = names_of(model)
         content%part = motions
         content%strain_part = strained
         content%natural = sqrt(max(pairs%value, 0.0_wp))/(2*pi)
         content%shape = pairs%vector
         content%mesh = mesh_names(self%input)
         content%deformation = matmul(transpose(model%mesh_direction), pairs%vector)
         allocate (content%share(4, m), content%strain_share(3, m))
         do i = 1, m
            content%share(:, i) = rotor_shares(model, pairs%vector(:, i))
            content%strain_share(:, i) = strain_shares(model, pairs%vector(:, i), closed)
         end do
      end associate
      content%speed = [0.0_wp]
      content%frequency = reshape(content%natural, [m, 1])
   end subroutine find_rotor_modes

   function mesh_names(input) result(names)
      type(input_t), intent(in) :: input
      character(64), allocatable :: names(:)

      character(:), allocatable :: name
      integer :: i

      allocate (names(input%count("gear_mesh")))
      do i = 1, size(names)
         call input%get("gear_mesh", i, "name", name)
         names(i) = name
      end do
   end function mesh_names

   pure function names_of(model) result(names)
      type(rotor_model_t), intent(in) :: model
      character(64), allocatable :: names(:)

      integer :: i

      allocate (names(model%numbering%n))
      do i = 1, size(names)
         names(i) = model%numbering%name(model%rotor, i)
      end do
   end function names_of

   !> Eigenvalues over the speed, critical speeds, stability limit.
   subroutine find_campbell(self, content, error)
      type(modes_task_t), intent(in) :: self
      type(modes_content_t), intent(inout) :: content
      type(error_t), allocatable, intent(out) :: error

      type(whirl_problem_t) :: damped, problem
      type(campbell_t) :: diagram
      real(wp), allocatable :: order(:)
      real(wp) :: first, last
      logical :: circulatory, gyroscopic, with_damping
      integer :: i, modes, points

      call self%input%get("campbell", 1, "first_rpm", first)
      call self%input%get("campbell", 1, "last_rpm", last)
      call self%input%get("campbell", 1, "points", points)
      call self%input%get("campbell", 1, "orders", order)
      call self%input%get("campbell", 1, "damped", with_damping)
      call self%input%get("rotation", 1, "gyroscopic", gyroscopic)
      call self%input%get("rotation", 1, "circulatory", circulatory)
      damped = new_whirl(self%rotor%reduced, self%contacts == contacts_closed)
      if (.not. gyroscopic) damped%modal%gyroscopic = 0.0_wp
      problem = damped
      if (.not. with_damping) problem%damping = 0.0_wp
      modes = min(self%count, size(damped%squared))
      content%speed = [((first + (last - first)*(real(i, wp)/(points - 1)))*pi/30, i=0, points - 1)]
      diagram = new_campbell(problem, self%rotor%model, content%speed, modes, order, circulatory .and. with_damping)
      if (diagram%status /= whirl_found) then
         call raise(error, "an eigenproblem could not be solved")
         return
      end if
      content%frequency = aimag(diagram%value)/(2*pi)
      content%eigenvalue = parts_of(diagram%value)
      content%branch = real(diagram%branch, wp)
      content%direction = diagram%direction
      call mark_missing(content, diagram%branch)
      associate (critical => diagram%critical)
         content%critical = critical%speed
         content%lost = int(diagram%lost, int32)
         content%critical_order = critical%order
         content%critical_frequency = critical%frequency/(2*pi)
         content%critical_direction = critical%direction
         content%critical_branch = real(critical%branch, wp)
      end associate
      call find_limit(content, damped, points - 1, circulatory)
   end subroutine find_campbell

   !> NaN for modes that a speed does not have.
   subroutine mark_missing(content, branch)
      type(modes_content_t), intent(inout) :: content
      integer, intent(in) :: branch(:, :)

      real(wp) :: nan
      integer :: i, k

      nan = ieee_value(nan, ieee_quiet_nan)
      do k = 1, size(branch, 2)
         do i = 1, size(branch, 1)
            if (branch(i, k) > 0) cycle
            content%frequency(i, k) = nan
            content%eigenvalue(:, i, k) = nan
            content%branch(i, k) = nan
            content%direction(i, k) = nan
         end do
      end do
   end subroutine mark_missing

   !> The stability limit between the first and the last speed.
   subroutine find_limit(content, problem, parts, circulatory)
      type(modes_content_t), intent(inout) :: content
      type(whirl_problem_t), intent(in) :: problem
      integer, intent(in) :: parts
      logical, intent(in) :: circulatory

      type(limit_t) :: limit

      limit = stability_limit(problem, content%speed(1), content%speed(parts + 1), parts, circulatory, limit_tolerance)
      content%limit = limit%speed
      select case (limit%status)
      case (limit_found)
         content%limit_words = "found"
      case (limit_below)
         content%limit_words = "unstable at the first speed already"
      case (limit_failed)
         content%limit_words = "an eigenproblem was not solved"
      case default
         content%limit_words = "none up to the last speed"
      end select
      if (limit%status /= limit_found) content%limit = ieee_value(content%limit, ieee_quiet_nan)
   end subroutine find_limit

end module modes_case
